//! Vectors and shapes as they are written in a job file.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Components along x, y (and z in 3D): as many as the job has dimensions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline, transform = two_or_three)]
pub struct Vector(pub Vec<f64>);

fn two_or_three(schema: &mut schemars::Schema) {
    schema.insert("minItems".into(), 2.into());
    schema.insert("maxItems".into(), 3.into());
    // Metres across a solar system; squares and sums stay finite.
    bound_items(schema, 1e12);
}

/// Bounds the magnitude of each component.
pub(crate) fn bound_items(schema: &mut schemars::Schema, limit: f64) {
    if let Some(items) = schema.get_mut("items").and_then(serde_json::Value::as_object_mut) {
        items.insert("minimum".into(), (-limit).into());
        items.insert("maximum".into(), limit.into());
    }
}

fn one() -> f64 {
    1.0
}

/// A region of space.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box along the axes.
    Box {
        /// Lower corner, m.
        min: Vector,
        /// Upper corner, m.
        max: Vector,
    },
    /// A disc; 2D only.
    #[schemars(extend("x-dimension" = 2))]
    Circle {
        /// Centre, m.
        centre: Vector,
        /// Radius, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        radius: f64,
    },
    /// A ball; 3D only.
    #[schemars(extend("x-dimension" = 3))]
    Sphere {
        /// Centre, m.
        centre: Vector,
        /// Radius, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        radius: f64,
    },
    /// A circular cylinder; 3D only.
    #[schemars(extend("x-dimension" = 3))]
    Cylinder {
        /// Centre of one end, m.
        base: Vector,
        /// Direction from that end to the other, any length; z by default.
        #[serde(default)]
        axis: Option<Vector>,
        /// Distance between the ends, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        height: f64,
        /// Radius, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        radius: f64,
    },
    /// A circular cone, possibly truncated; 3D only.
    #[schemars(extend("x-dimension" = 3))]
    Cone {
        /// Centre of the wide end, m.
        base: Vector,
        /// Direction from the base to the tip, any length; z by default.
        #[serde(default)]
        axis: Option<Vector>,
        /// Distance from the base to the tip or to the truncated end, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        height: f64,
        /// Radius of the base, m.
        #[schemars(range(max = 1e12), extend("exclusiveMinimum" = 0.0))]
        radius: f64,
        /// Radius of the other end, m; 0, a pointed cone, by default.
        #[serde(default)]
        #[schemars(range(min = 0.0, max = 1e12))]
        top_radius: f64,
    },
    /// Everything on one side of a plane.
    HalfSpace {
        /// A point of the plane, m.
        point: Vector,
        /// Direction out of the half-space, any length.
        normal: Vector,
    },
    /// A simple polygon; 2D only.
    #[schemars(extend("x-dimension" = 2))]
    Polygon {
        /// Corners in order, m; at least three.
        #[schemars(length(max = 10_000))]
        points: Vec<Vector>,
    },
    /// A solid bounded by triangles, from a file; 3D only.
    #[schemars(extend("x-dimension" = 3))]
    Mesh {
        /// File in STL (text or binary), OBJ or PLY (text or binary), by its ending; relative to the
        /// directory of the job file.
        file: String,
        /// Metres per unit of the file: 0.001 for millimetres.
        #[serde(default = "one")]
        #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
        scale: f64,
        /// Rule that tells the inside: `closed` by default.
        #[serde(default)]
        solid: Solid,
        /// Where the origin of the file lies, m; the origin of the job by default.
        #[serde(default)]
        origin: Option<Vector>,
    },
    /// Terrain: the solid below a surface of heights, from a raster; 3D only, z points up.
    #[schemars(extend("x-dimension" = 3))]
    Terrain {
        /// ESRI ASCII grid (`.asc`), GeoTIFF (`.tif`) or array of NumPy (`.npy`, `.npz`), rows from north to
        /// south, every cell with a height; relative to the directory of the job file.
        file: String,
        /// Distance of neighbouring heights, m: for arrays, which do not have it, or in place of that of the
        /// file; the south-western height then stands at the origin of the raster's coordinates.
        #[serde(default)]
        #[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))]
        cell: Option<f64>,
        /// Name of the array in a file with several (`.npz`).
        #[serde(default)]
        array: Option<String>,
        /// How the surface runs between the heights: `triangles` by default.
        #[serde(default)]
        surface: Surface,
        /// The solid is a layer on the terrain, this thick, m, measured upwards: a number, or the name of a
        /// raster with the same cells, with no layer where it has no data. By default it is all that lies
        /// below the surface.
        #[serde(default)]
        thickness: Option<Thickness>,
        /// Where the origin of the raster's coordinates lies, m; the origin of the job by default.
        #[serde(default)]
        origin: Option<Vector>,
        /// Height in the raster down to which the solid reaches, m; by default a tenth of the raster's length
        /// below its least height.
        #[serde(default)]
        #[schemars(range(min = -1e9, max = 1e9))]
        base: Option<f64>,
    },
    /// Particles from a file, one by one, as a body of their own; not a part of other shapes.
    Particles {
        /// Comma-separated values (`.csv`), PLY (`.ply`), or an output or checkpoint of agimp (`.hdf`,
        /// `.h5`), of which the particles of the body with this name are taken, or all if there is one body;
        /// relative to the directory of the job file.
        file: String,
    },
    /// A shape turned about a point.
    Rotated {
        /// The shape before the rotation.
        shape: Box<Shape>,
        /// Fixed point, m.
        centre: Vector,
        /// Axis of the rotation, any length; 3D only, z by default.
        #[serde(default)]
        #[schemars(extend("x-dimension" = 3))]
        axis: Option<Vector>,
        /// Angle, degrees, counter-clockwise seen against the axis.
        #[schemars(range(min = -360.0, max = 360.0))]
        angle: f64,
    },
    /// Points of any of the parts.
    Union {
        /// Parts; at least one.
        parts: Vec<Shape>,
    },
    /// Points of all the parts.
    Intersection {
        /// Parts; at least one.
        parts: Vec<Shape>,
    },
    /// Points of a shape that lie in none of those removed.
    Difference {
        /// The shape of which a rest is left.
        from: Box<Shape>,
        /// Shapes removed; at least one.
        remove: Vec<Shape>,
    },
}

/// Rule that tells the inside of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Solid {
    /// Inside is the space that the surface encloses: it is closed, its triangles face one way, and it does
    /// not cross itself.
    #[default]
    Closed,
    /// Inside is the space that the surface winds around: holes are closed by cones over their rims, overlaps
    /// are filled, and triangles may face either way.
    Winding,
}

/// How the surface of a terrain runs between the heights.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Surface {
    /// Two triangles for each cell.
    #[default]
    Triangles,
    /// A cubic surface through the heights, in triangles of a quarter of a cell.
    Smooth,
}

/// Thickness of a layer.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Thickness {
    /// The same everywhere, m.
    Constant(#[schemars(range(max = 1e9), extend("exclusiveMinimum" = 0.0))] f64),
    /// From a raster, m.
    Raster(String),
}
