//! Free rigid bodies of the job file to those of the solver: mass and inertia, given or those of the shape.
use std::cell::OnceCell;

use super::keys::{Z, allowed, optional};
use super::records;
use crate::boundary::motion::{Free, Rate, Table};
use crate::boundary::rigid::{Meeting, turning};
use crate::boundary::vector::length;
use crate::geometry::{Moments, Shape};
use crate::job::convert::checks::Checks;
use crate::job::parse::source::Path;
use crate::job::schema::common::Spin;
use crate::job::schema::conditions::colliders::{Inertia, Motion as Written};
use crate::text::written;

/// A free body, its axis, and the reference point if that follows from the shape.
pub(super) type Body<const D: usize> = (Free<D>, [f64; 3], Option<[f64; D]>);

/// Coefficient of friction between rigid bodies unless a job gives one.
const FRICTION: f64 = 0.5;

/// Rotation of a body.
enum Turns {
    Never,
    About([f64; 3]),
    Freely,
}

/// Checks a free body, whose collider has this shape, and this reference point if one is given.
pub(super) fn free_body<const D: usize>(
    checks: &mut Checks,
    motion: &Written,
    shape: &Shape<D>,
    reference: Option<&[f64; D]>,
    paths: [&Path; 2],
) -> Option<Body<D>> {
    let Written::Free {
        mass,
        density,
        velocity,
        along,
        turns,
        inertia,
        axis,
        angular_velocity,
        collides,
        friction,
        restitution,
        rows,
        record,
    } = motion
    else {
        return None;
    };
    let [path, collider] = paths;
    let velocity = optional(checks, velocity.as_ref(), &path.key("velocity"));
    let along = allowed::<D>(checks, along.as_deref(), &path.key("along"))?;
    let axis = match axis {
        Some(_) => Some(checks.turning_axis::<D>(axis.as_ref(), &path.key("axis"))?),
        None => None,
    };
    let velocity: [f64; D] = velocity?;
    for a in (0..D).filter(|&a| !along[a] && velocity[a] != 0.0) {
        let message =
            format!("found {}; expected 0 along an axis that is not in `along`", written(velocity[a]));
        checks.fault(&path.key("velocity").index(a), message);
    }
    let by_default = D == 3 || inertia.is_some() || density.is_some();
    let how = match (turns.unwrap_or(by_default), axis, inertia) {
        (false, ..) => Turns::Never,
        (true, Some(axis), _) => Turns::About(axis),
        (true, None, Some(Inertia::Axis(_))) => Turns::About(Z),
        (true, None, _) if D == 2 => Turns::About(Z),
        (true, None, _) => Turns::Freely,
    };
    let meeting = meeting(checks, *collides, [*friction, *restitution], path);
    let driven = if rows.is_some() || record.is_some() {
        let table = records::rows(checks, rows.as_deref(), record.as_ref(), path)?;
        driven(checks, table, &along, !matches!(how, Turns::Never), (path, rows.is_some()))?
    } else {
        Table::default()
    };
    // The sum over the cells of a boolean takes long, so it is made at its first use.
    let found = OnceCell::new();
    let mut of_shape = |key: &'static str| {
        let moments = *found.get_or_init(|| shape.moments());
        if moments.is_none() {
            let message = "found a shape without a volume, or an unbounded one; expected `mass` and `inertia`, \
                           or `turns = false`, for such a body";
            checks.fault(&path.key(key), message.into());
        }
        moments
    };
    let mass = match (mass, density) {
        (Some(mass), None) => *mass,
        (None, Some(density)) => density * of_shape("density")?.volume,
        (None, None) => {
            checks.fault(path, "found neither `mass` nor `density`; expected one of them".into());
            return None;
        }
        (Some(_), Some(_)) => {
            let message = "found both `mass` and `density`; expected one of them";
            checks.fault(&path.key("density"), message.into());
            return None;
        }
    };
    let spin = angular_velocity.as_ref();
    let here = path.key("angular_velocity");
    let start = Rate::about_axis(velocity, 0.0);
    let mut free = Free { mass, along, inertia: None, turning: None, meeting, driven, start };
    match how {
        Turns::Never => {
            let at_rest = match spin {
                None => true,
                Some(Spin::Plane(spin)) => *spin == 0.0,
                Some(Spin::Space(spin)) => *spin == [0.0; 3],
            };
            if !at_rest {
                let message = "found an angular velocity; expected it only for a body that turns: give `inertia`, \
                               `density` or `turns = true`";
                checks.fault(&here, message.into());
            }
            Some((free, axis.unwrap_or(Z), None))
        }
        Turns::About(axis) => {
            free.start.spin = match spin {
                None => 0.0,
                Some(Spin::Plane(spin)) => *spin,
                Some(Spin::Space(_)) => {
                    let message =
                        "found an array; expected a number, the angular velocity about the fixed axis";
                    checks.fault(&here, message.into());
                    return None;
                }
            };
            let (about, centre) = match inertia {
                Some(Inertia::Axis(given)) => (*given, None),
                Some(Inertia::Principal(_)) => {
                    let message =
                        "found three numbers; expected one, for a body that turns about a fixed axis";
                    checks.fault(&path.key("inertia"), message.into());
                    return None;
                }
                None => {
                    let moments = of_shape("turns")?;
                    let at = reference.unwrap_or(&moments.centre);
                    (about_axis(&moments, mass, &axis, at), Some(moments.centre))
                }
            };
            free.inertia = Some(about);
            Some((free, axis, centre))
        }
        Turns::Freely => {
            free.start.turning = match spin {
                None => [0.0; 3],
                Some(Spin::Space(spin)) => *spin,
                Some(Spin::Plane(_)) => {
                    let message = "found a number; expected three components, since the body turns about any axis; or give \
                                   its `axis`";
                    checks.fault(&here, message.into());
                    return None;
                }
            };
            if let Some(Inertia::Principal([a, b, c])) = inertia {
                for (k, [one, p, q]) in [[*a, *b, *c], [*b, *c, *a], [*c, *a, *b]].into_iter().enumerate() {
                    if one > (p + q) * (1.0 + 1e-12) {
                        let message = format!(
                            "found {}; expected at most the sum of the other two, {}, as for any solid",
                            written(one),
                            written(p + q)
                        );
                        checks.fault(&path.key("inertia").index(k), message);
                    }
                }
                free.turning = Some(turning::Inertia::new([[*a, 0.0, 0.0], [0.0, *b, 0.0], [0.0, 0.0, *c]]));
                return Some((free, Z, None));
            }
            let moments = of_shape("mass")?;
            if reference.is_some() {
                let message = "found a reference point; expected none for a body that turns about its centre of mass, or `inertia` or `axis` in `motion`";
                checks.fault(&collider.key("reference"), message.into());
                return None;
            }
            free.turning = Some(turning::Inertia::new(tensor(&moments, mass)));
            Some((free, Z, Some(moments.centre)))
        }
    }
}

/// Friction and restitution of a body in collisions with other colliders; `None` if it passes through them.
fn meeting(
    checks: &mut Checks,
    collides: Option<bool>,
    [friction, restitution]: [Option<f64>; 2],
    path: &Path,
) -> Option<Meeting> {
    if collides.unwrap_or(true) {
        return Some(Meeting {
            friction: friction.unwrap_or(FRICTION),
            restitution: restitution.unwrap_or(0.0),
        });
    }
    for (key, given) in [("friction", friction), ("restitution", restitution)] {
        if given.is_some() {
            let message = "found friction for a body without collisions; expected none, or `collides = true`";
            checks.fault(&path.key(key), message.into());
        }
    }
    None
}

/// The table of a body that is free along some axes only: each of its motions is along another one, or a
/// rotation of a body that does not turn by itself.
fn driven<const D: usize>(
    checks: &mut Checks,
    table: Table<D>,
    along: &[bool; D],
    turns: bool,
    (path, is_of_job): (&Path, bool),
) -> Option<Table<D>> {
    let here = |row: usize, key: &'static str| match is_of_job {
        true => path.key("rows").index(row).key(key),
        false => path.key("record"),
    };
    for (i, row) in table.rows.iter().enumerate() {
        let before = checks.faults.len();
        for a in (0..D).filter(|&a| along[a] && row.translation[a] != 0.0) {
            let message = format!(
                "found {}; expected 0 along an axis on which the body is free: leave it out of `along`",
                written(row.translation[a])
            );
            let here = here(i, "translation");
            checks.fault(&if is_of_job { here.index(a) } else { here.key(["x", "y", "z"][a]) }, message);
        }
        if turns && row.angle != 0.0 {
            let message = "found a rotation for a body that turns freely; expected `turns = false`";
            let here = here(i, "rotation");
            checks.fault(&if is_of_job { here } else { here.key("rotation") }, message.into());
        }
        // A file may have many such rows.
        if !is_of_job && checks.faults.len() > before {
            break;
        }
    }
    Some(table)
}

/// Inertia about the centre of mass, `∫ (|r|² 1 - r rᵀ) ρ dV`, kg m²; in 2D of one metre of thickness and
/// about z alone.
fn tensor<const D: usize>(moments: &Moments<D>, mass: f64) -> [[f64; 3]; 3] {
    let density = mass / moments.volume;
    let second = |i: usize, j: usize| if i < D && j < D { density * moments.second[i][j] } else { 0.0 };
    let trace: f64 = (0..D).map(|k| second(k, k)).sum();
    std::array::from_fn(|i| {
        std::array::from_fn(
            |j| if i == j { trace - second(i, i) } else { -0.5 * (second(i, j) + second(j, i)) },
        )
    })
}

/// Inertia about an axis through a point, by Steiner's theorem, kg m².
fn about_axis<const D: usize>(moments: &Moments<D>, mass: f64, axis: &[f64; 3], at: &[f64; D]) -> f64 {
    let tensor = tensor(moments, mass);
    let own: f64 = (0..3).map(|i| (0..3).map(|j| axis[i] * tensor[i][j] * axis[j]).sum::<f64>()).sum();
    let arm: [f64; 3] = std::array::from_fn(|a| if a < D { at[a] - moments.centre[a] } else { 0.0 });
    let along = (0..3).fold(0.0, |sum, a| axis[a].mul_add(arm[a], sum));
    let across = length(&std::array::from_fn::<f64, 3, _>(|a| arm[a] - along * axis[a]));
    own + mass * across * across
}
