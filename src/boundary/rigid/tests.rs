//! Bodies among faces and each other, against closed forms and conservation laws.
use super::turning::Inertia;
use super::{Features, Meeting, Push, Surroundings};
use crate::boundary::motion::{Free, Motion, Rate, Table};
use crate::boundary::vector::cross;
use crate::boundary::vector::length;
use crate::boundary::{ActsOn, Collider, ColliderState, Contact};
use crate::geometry::{Aabb, Placement, Shape, rotation};

/// Bodies in a domain of 100 m whose floor holds them.
struct Scene<const D: usize> {
    colliders: Vec<Collider<D>>,
    states: Vec<ColliderState<D>>,
    features: Vec<Features<D>>,
    gravity: [f64; D],
    time: f64,
}

impl<const D: usize> Scene<D> {
    fn new(colliders: Vec<Collider<D>>, gravity: [f64; D]) -> Self {
        let states = colliders.iter().map(|c| c.state_at(0.0)).collect();
        let features = colliders.iter().map(|c| Features::of(&c.shape)).collect();
        Self { colliders, states, features, gravity, time: 0.0 }
    }

    fn step(&mut self, dt: f64) {
        let free = Contact::default();
        let all = Surroundings {
            colliders: &self.colliders,
            states: &self.states,
            features: &self.features,
            faces: &[[free; 2]; D],
            extent: [100.0; D],
        };
        let mut rates: Vec<Rate<D>> = self
            .colliders
            .iter()
            .zip(&self.states)
            .map(|(c, s)| c.step_rate(s, &self.gravity, self.time, dt))
            .collect();
        let pushes = all.touch(&mut rates, dt);
        self.time += dt;
        for (c, collider) in self.colliders.iter().enumerate() {
            let Push { impulse, turn } = pushes[c];
            let linear = std::array::from_fn(|a| impulse[a]);
            self.states[c] =
                collider.advanced(&self.states[c], &rates[c], &self.gravity, [self.time, dt], linear, turn);
        }
    }

    fn place(&self, c: usize) -> [f64; D] {
        self.colliders[c].centre(&self.states[c].pose)
    }
}

/// A body of density 1000 kg/m³ that turns about any axis.
fn body<const D: usize>(shape: Shape<D>, friction: f64, restitution: f64, start: Rate<D>) -> Collider<D> {
    let moments = shape.moments().expect("a volume");
    let second = |i: usize, j: usize| if i < D && j < D { 1000.0 * moments.second[i][j] } else { 0.0 };
    let trace: f64 = (0..3).map(|k| second(k, k)).sum();
    let tensor = std::array::from_fn(|i| {
        std::array::from_fn(|j| if i == j { trace - second(i, j) } else { -second(i, j) })
    });
    let meeting = Some(Meeting { friction, restitution });
    let turning = (D == 3).then(|| Inertia::new(tensor));
    let inertia = (D == 2).then_some(tensor[2][2]);
    let mass = 1000.0 * moments.volume;
    let free = Free { mass, along: [true; D], inertia, turning, meeting, driven: Table::default(), start };
    collider(shape, Motion::Free(free), moments.centre)
}

fn collider<const D: usize>(shape: Shape<D>, motion: Motion<D>, reference: [f64; D]) -> Collider<D> {
    Collider {
        name: "body".into(),
        shape,
        deforming: None,
        reference,
        axis: [0.0, 0.0, 1.0],
        contact: Contact::Sticky,
        acts_on: ActsOn::Nodes,
        motion,
        start: 0.0,
    }
}

fn ball(centre: [f64; 3], radius: f64) -> Shape<3> {
    Shape::Sphere { centre, radius }
}

fn cuboid(lower: [f64; 3], upper: [f64; 3]) -> Shape<3> {
    Shape::Box(Aabb::new(lower, upper))
}

/// Each bounce reaches e² times the height of the one before, and all bounces end at the limit of the series.
#[test]
fn balls_bounce_as_restitution_says() {
    for e in [1.0, 0.5, 0.8] {
        let shape = ball([50.0, 50.0, 1.1], 0.1);
        let mut scene = Scene::new(vec![body(shape, 0.3, e, Rate::REST)], [0.0, 0.0, -9.81]);
        let (mut apexes, mut before) = (Vec::new(), 0.0);
        while scene.time < 3.0 {
            scene.step(2e-4);
            let speed = scene.states[0].rate.velocity[2];
            if before > 0.0 && speed <= 0.0 {
                apexes.push(scene.place(0)[2] - 0.1);
            }
            before = speed;
        }
        println!("e = {e}: {apexes:?}");
        let exact = |n: i32| f64::powi(e * e, n);
        for (n, apex) in apexes.iter().take(3).enumerate() {
            assert!((apex / exact(n as i32 + 1) - 1.0).abs() < 0.01, "{e}: {apexes:?}");
        }
        assert!(apexes.len() >= 2);
    }
}

/// Down a slope a ball that rolls gains 5/7 g sin α, one that slips g (sin α - μ cos α), a box that slides
/// the same; above tan α a box stays.
#[test]
fn balls_roll_and_boxes_slide_down_slopes() {
    let slope = |degrees: f64| {
        let (s, c) = degrees.to_radians().sin_cos();
        let plane = Shape::HalfSpace { point: [50.0, 50.0, 50.0], normal: [s, 0.0, c] };
        (collider(plane, Motion::Fixed, [50.0; 3]), s, c)
    };
    for (degrees, friction) in [(30.0, 1.0), (30.0, 0.1), (10.0, 0.5), (20.0, 0.0)] {
        let (plane, s, c) = slope(degrees);
        let centre = [50.0 + 0.1 * s, 50.0, 50.0 + 0.1 * c];
        let mut scene =
            Scene::new(vec![plane, body(ball(centre, 0.1), friction, 0.0, Rate::REST)], [0.0, 0.0, -9.81]);
        for _ in 0..1000 {
            scene.step(1e-3);
        }
        let v = scene.states[1].rate.velocity;
        let (found, x) = ((c * v[0] - s * v[2]) / scene.time, scene.place(1));
        let exact = 9.81 * f64::max(5.0 / 7.0 * s, s - friction * c);
        let hover = s * (x[0] - 50.0) + c * (x[2] - 50.0) - 0.1;
        println!(
            "{degrees} degrees, {friction}: {found:.6}, exact {exact:.6}, hover {hover:.1e}, spin {:?}",
            scene.states[1].rate.turning
        );
        assert!((found / exact - 1.0).abs() < 1e-3 && hover.abs() < 1e-6, "{found} {exact} {hover}");
    }
    for (degrees, friction) in [(30.0_f64, 0.2), (30.0, 0.7), (15.0, 0.0)] {
        let (plane, s, c) = slope(degrees);
        let turn = Placement { rotation: rotation([0.0, 1.0, 0.0], degrees.to_radians()), pivot: [50.0; 3] };
        let block = cuboid([49.9, 49.9, 50.0], [50.1, 50.1, 50.1]);
        let shape = Shape::Rotated(Box::new(block), turn);
        let mut scene = Scene::new(vec![plane, body(shape, friction, 0.0, Rate::REST)], [0.0, 0.0, -9.81]);
        for _ in 0..500 {
            scene.step(1e-3);
        }
        let v = scene.states[1].rate.velocity;
        let (found, turning) = ((c * v[0] - s * v[2]) / scene.time, length(&scene.states[1].rate.turning));
        let exact = 9.81 * f64::max(0.0, s - friction * c);
        println!("box, {degrees} degrees, {friction}: {found:.6}, exact {exact:.6}, turning {turning:.1e}");
        assert!((found - exact).abs() < 1e-3 * 9.81 * s && turning < 1e-6, "{found} {exact} {turning}");
    }
}

/// A ball that starts sliding on the floor rolls at 5/7 of its speed after 2 v / (7 μ g).
#[test]
fn balls_slide_until_they_roll() {
    for (v, friction) in [(1.0, 0.1), (2.0, 0.3), (3.0, 0.2)] {
        let start = Rate { velocity: [v, 0.0, 0.0], ..Rate::REST };
        let mut scene =
            Scene::new(vec![body(ball([20.0, 50.0, 0.1], 0.1), friction, 0.0, start)], [0.0, 0.0, -9.81]);
        let rolls = 2.0 * v / (7.0 * friction * 9.81);
        let mut found = f64::INFINITY;
        while scene.time < 1.5 * rolls {
            scene.step(1e-4);
            let rate = &scene.states[0].rate;
            if found.is_infinite() && (rate.velocity[0] - 0.1 * rate.turning[1]).abs() < 1e-9 {
                found = scene.time;
            }
        }
        let rate = &scene.states[0].rate;
        println!("{v} m/s, {friction}: rolls at {found:.4} s ({rolls:.4}), {:?}", rate);
        assert!(
            (found / rolls - 1.0).abs() < 0.01 && (rate.velocity[0] / (5.0 / 7.0 * v) - 1.0).abs() < 1e-3
        );
    }
}

/// Three boxes on top of each other stay at rest, rotated or not.
#[test]
fn stacks_rest() {
    for degrees in [0.0_f64, 20.0] {
        let stacked = |k: usize| {
            let z = 0.2 * k as f64;
            let cuboid = cuboid([49.9, 49.85, z], [50.1, 50.15, z + 0.2]);
            let angle = k as f64 * degrees.to_radians();
            let turn = Placement { rotation: rotation([0.0, 0.0, 1.0], angle), pivot: [50.0, 50.0, 0.0] };
            body(Shape::Rotated(Box::new(cuboid), turn), 0.5, 0.2, Rate::REST)
        };
        let mut scene = Scene::new((0..3).map(stacked).collect(), [0.0, 0.0, -9.81]);
        for _ in 0..3000 {
            scene.step(1e-3);
        }
        for c in 0..3 {
            let x = scene.place(c);
            let off = [x[0] - 50.0, x[1] - 50.0, x[2] - 0.1 - 0.2 * c as f64];
            let q = scene.states[c].pose.orientation;
            println!("{degrees}: {c} off by {:.1e}, turned by {:.1e}", length(&off), q.imag().norm());
            assert!(length(&off) < 1e-6 && q.imag().norm() < 1e-6, "{off:?} {q:?}");
        }
    }
}

/// Two balls in an off-centre collision with friction: momentum and angular momentum are conserved to
/// round-off; without friction, energy as well. Places near 50 m are rounded to 7e-15 m, and the arm of the
/// angular momentum is 0.09 m: that is an error of 1e-13 in each collision.
#[test]
fn blows_keep_momentum_and_angular_momentum() {
    for friction in [0.0, 0.4] {
        let spinning = Rate { velocity: [2.0, 0.1, 0.0], turning: [1.0, 5.0, -3.0], ..Rate::REST };
        let mut scene = Scene::new(
            vec![
                body(ball([49.7, 50.0, 50.0], 0.1), friction, 1.0, spinning),
                body(ball([50.0, 50.08, 50.04], 0.15), friction, 1.0, Rate::REST),
            ],
            [0.0; 3],
        );
        let totals = |scene: &Scene<3>| {
            let (mut momentum, mut turn, mut energy) = ([0.0; 3], [0.0; 3], 0.0);
            for (c, state) in scene.states.iter().enumerate() {
                let free = scene.colliders[c].free().expect("free");
                let p = state.rate.velocity.map(|v| v * free.mass);
                let orbit = cross(scene.place(c).map(|x| x - 50.0), p);
                for a in 0..3 {
                    momentum[a] += p[a];
                    turn[a] += orbit[a] + state.momentum[a];
                    energy +=
                        0.5 * (p[a] * state.rate.velocity[a] + state.momentum[a] * state.rate.turning[a]);
                }
            }
            (momentum, turn, energy)
        };
        let before = totals(&scene);
        for _ in 0..300 {
            scene.step(1e-3);
        }
        let after = totals(&scene);
        let off = |a: [f64; 3], b: [f64; 3]| length(&[a[0] - b[0], a[1] - b[1], a[2] - b[2]]) / length(&a);
        let errors = [off(before.0, after.0), off(before.1, after.1)];
        println!(
            "friction {friction}: momentum {:.1e} {:.1e}, energy {:.6}",
            errors[0],
            errors[1],
            after.2 / before.2
        );
        assert!(scene.states[1].rate.velocity[0] > 0.1 && errors.iter().all(|e| *e < 1e-12), "{errors:?}");
        assert!(after.2 <= before.2 * (1.0 + 1e-12) && (friction > 0.0 || after.2 > before.2 * (1.0 - 1e-9)));
    }
}

/// A disc in a plane rolls down a slope with 2/3 g sin α.
#[test]
fn discs_roll_in_a_plane() {
    let (s, c) = 30.0_f64.to_radians().sin_cos();
    let plane = collider(Shape::HalfSpace { point: [50.0; 2], normal: [s, c] }, Motion::Fixed, [50.0; 2]);
    let shape = Shape::Sphere { centre: [50.0 + 0.1 * s, 50.0 + 0.1 * c], radius: 0.1 };
    let mut scene = Scene::new(vec![plane, body(shape, 0.8, 0.0, Rate::REST)], [0.0, -9.81]);
    for _ in 0..1000 {
        scene.step(1e-3);
    }
    let v = scene.states[1].rate.velocity;
    let (found, exact) = ((c * v[0] - s * v[1]) / scene.time, 9.81 * 2.0 / 3.0 * s);
    println!("{found:.6}, exact {exact:.6}");
    assert!((found / exact - 1.0).abs() < 1e-3);
}

/// A cube dropped on an edge comes to lie on a face; a cylinder on its end.
#[test]
fn bodies_come_to_lie() {
    let tilted = |shape: Shape<3>, axis: [f64; 3], degrees: f64| {
        let turn = Placement { rotation: rotation(axis, degrees.to_radians()), pivot: [50.0, 50.0, 0.3] };
        Shape::Rotated(Box::new(shape), turn)
    };
    let cube = tilted(cuboid([49.9, 49.9, 0.2], [50.1, 50.1, 0.4]), [0.6, 0.8, 0.0], 35.0);
    let long = crate::geometry::Frustum {
        base: [50.0, 50.0, 0.25],
        axis: [0.0, 0.0, 1.0],
        height: 0.1,
        lower_radius: 0.1,
        upper_radius: 0.1,
    };
    let cylinder = tilted(Shape::Frustum(long), [1.0, 0.0, 0.0], 20.0);
    for (shape, height) in [(cube, 0.1), (cylinder, 0.05)] {
        let mut scene = Scene::new(vec![body(shape, 0.5, 0.3, Rate::REST)], [0.0, 0.0, -9.81]);
        for _ in 0..4000 {
            scene.step(1e-3);
        }
        let (z, rate) = (scene.place(0)[2], &scene.states[0].rate);
        println!("at {z:.6}, {rate:?}");
        assert!((z - height).abs() < 1e-3 && length(&rate.turning) < 1e-3 && length(&rate.velocity) < 1e-3);
    }
}
