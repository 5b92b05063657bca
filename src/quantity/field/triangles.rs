//! Values between points of a plane: linear on the triangles of Delaunay.
use spade::handles::VertexHandle;
use spade::{
    DelaunayTriangulation, HasPosition, HierarchyHintGenerator, Point2, PositionInTriangulation,
    Triangulation as _,
};

/// A value at a point of the plane.
#[derive(Clone, Copy, Debug)]
struct Sample {
    place: Point2<f64>,
    value: f64,
}

impl HasPosition for Sample {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.place
    }
}

/// A search in it begins at a place that depends on nothing but the point, so that its result has the same
/// bits in any thread.
type Mesh = DelaunayTriangulation<Sample, (), (), (), HierarchyHintGenerator<f64>>;

/// Values at points over two coordinates.
#[derive(Debug)]
pub(super) struct Triangles {
    pub(super) axes: [usize; 2],
    mesh: Mesh,
}

impl Triangles {
    /// From rows of two coordinates (m) and a value.
    ///
    /// # Errors
    /// In words: the points span no triangle.
    pub(super) fn new(axes: [usize; 2], rows: impl Iterator<Item = [f64; 3]>) -> Result<Self, String> {
        let samples = rows.map(|[x, y, value]| Sample { place: Point2::new(x, y), value });
        let mesh = Mesh::bulk_load(samples.collect()).map_err(|error| error.to_string())?;
        match mesh.all_vertices_on_line() {
            true => Err("its points lie on one line; expected points that span triangles".into()),
            false => Ok(Self { axes, mesh }),
        }
    }

    /// See [`super::Field::at`].
    pub(super) fn at(&self, place: [f64; 3]) -> f64 {
        let point = Point2::new(place[self.axes[0]], place[self.axes[1]]);
        match self.mesh.locate(point) {
            PositionInTriangulation::OnVertex(vertex) => self.mesh.vertex(vertex).data().value,
            PositionInTriangulation::OnEdge(edge) => {
                nearest(self.mesh.directed_edge(edge).vertices(), point).1
            }
            PositionInTriangulation::OnFace(face) => {
                let face = self.mesh.face(face);
                let shares = face.barycentric_interpolation(point);
                let corners = face.vertices().into_iter().zip(shares);
                corners.fold(0.0, |sum, (corner, share)| share.mul_add(corner.data().value, sum))
            }
            _ => {
                let edges = self.mesh.convex_hull().map(|edge| nearest(edge.vertices(), point));
                edges.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(f64::NAN, |(_, value)| value)
            }
        }
    }

    /// See [`super::Field::ranges`].
    pub(super) fn ranges(&self) -> Vec<(usize, [f64; 2])> {
        let places = || self.mesh.vertices().map(|vertex| vertex.data().place);
        let range = |of: fn(Point2<f64>) -> f64| {
            places().map(of).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)])
        };
        vec![(self.axes[0], range(|place| place.x)), (self.axes[1], range(|place| place.y))]
    }
}

/// Squared distance (m²) of a point from an edge, and the value at the place of the edge that is nearest.
fn nearest(ends: [VertexHandle<'_, Sample>; 2], point: Point2<f64>) -> (f64, f64) {
    let [from, to] = ends.map(|end| *end.data());
    let along = [to.place.x - from.place.x, to.place.y - from.place.y];
    let off = [point.x - from.place.x, point.y - from.place.y];
    let dot = |a: [f64; 2], b: [f64; 2]| a[0].mul_add(b[0], a[1] * b[1]);
    let share = (dot(along, off) / dot(along, along)).clamp(0.0, 1.0);
    let rest = [0, 1].map(|a| share.mul_add(-along[a], off[a]));
    (dot(rest, rest), share.mul_add(to.value - from.value, from.value))
}
