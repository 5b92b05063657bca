//! Free bodies that spin where regions of three levels meet, level 0 touching level 2.

/// A square of side 1 in the middle of 3 m x 3 m.
pub(crate) const SQUARE: &str = r#"
version = 1
dimension = 2
gravity = [0, 0]
[domain]
size = [3, 3]
root_edge = 1
[tree]
graded = false
regions = [
    { level = 1, shape = { kind = "box", min = [0, 0], max = [1.4, 1.4] } },
    { level = 2, shape = { kind = "box", min = [1.5, 1.5], max = [3, 3] } },
]
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e4
poisson = 0.3
[[bodies]]
name = "square"
material = "rubber"
shape = { kind = "box", min = [1, 1], max = [2, 2] }
angular_velocity = 1
[numerics]
transfer = "apic"
[time]
end = 1e3
dt_max = 1e3
[output]
every = 1e3
"#;

/// A cube of side 1 likewise.
pub(crate) const CUBE: &str = r#"
version = 1
dimension = 3
gravity = [0, 0, 0]
[domain]
size = [3, 3, 3]
root_edge = 1
[tree]
graded = false
regions = [
    { level = 1, shape = { kind = "box", min = [0, 0, 0], max = [1.4, 1.4, 3] } },
    { level = 2, shape = { kind = "box", min = [1.5, 1.5, 1.5], max = [1.7, 1.7, 1.7] } },
]
[[materials]]
name = "rubber"
density = 1000
model = "neo_hookean"
young = 1e4
poisson = 0.3
[[bodies]]
name = "cube"
material = "rubber"
shape = { kind = "box", min = [1, 1, 1], max = [2, 2, 2] }
angular_velocity = [0.3, -0.2, 1]
velocity = [0.01, 0.02, -0.01]
[numerics]
transfer = "apic"
[time]
end = 1e3
dt_max = 1e3
[output]
every = 1e3
"#;
