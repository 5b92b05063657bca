//! The quantities for which a scene is computed.
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::PointField;
use post::frame::Frame;
use toml::{Table, Value};

use crate::runs::Run;

/// Which quantities.
#[derive(Clone, Copy)]
pub(crate) enum Headline {
    /// Run-out and height of a column about the z axis.
    Collapse,
    /// Depth of the lowest point of the falling cylinder.
    Penetration,
    /// Length and greatest radius of a rod about the z axis.
    Bar,
}

/// Share of the mass within the run-out; the rest are far-flung grains.
const FRONT_SHARE: f64 = 0.98;

/// A particle as seen along the circumference.
struct Grain {
    /// Distance from the z axis, m.
    radius: f64,
    /// Height, m.
    height: f64,
    /// Half width of a cube of its volume, m.
    half: f64,
    /// Mass, kg.
    mass: f64,
}

impl Headline {
    /// Names and values, m.
    pub(crate) fn values(self, job: &Table, run: &Run) -> Result<Vec<(&'static str, f64)>, String> {
        if let Self::Penetration = self {
            return penetration(job, run).map(|depth| vec![("penetration", depth)]);
        }
        let mut grains = grains(run).map_err(|error| error.to_string())?;
        let top = |grains: &mut dyn Iterator<Item = &Grain>| {
            grains.map(|grain| grain.height + grain.half).fold(0.0, f64::max)
        };
        if let Self::Bar = self {
            let radius = grains.iter().map(|grain| grain.radius + grain.half).fold(0.0, f64::max);
            return Ok(vec![("length", top(&mut grains.iter())), ("radius", radius)]);
        }
        grains.sort_by(|a, b| a.radius.total_cmp(&b.radius));
        let total: f64 = grains.iter().map(|grain| grain.mass).sum();
        let mut inside = 0.0;
        let front = grains.iter().find(|grain| {
            inside += grain.mass;
            inside >= FRONT_SHARE * total
        });
        let front = front.ok_or("expected particles; found none")?.radius;
        // Near the axis: within a twentieth of the run-out.
        let height = top(&mut grains.iter().take_while(|grain| grain.radius < front / 20.0));
        Ok(vec![("run-out", front), ("height", height)])
    }
}

/// The particles at the end of a run.
fn grains(run: &Run) -> Result<Vec<Grain>, FileError> {
    let fields = [PointField::Mass, PointField::Density];
    let frame = Frame::read(&run.last_output, &fields, true)?;
    let [mass, density] = fields.map(|field| frame.numbers(field).unwrap_or_default());
    let each = frame.positions.iter().zip(mass.iter().zip(&density));
    Ok(each
        .map(|(x, (&mass, &density))| Grain {
            radius: x[0].hypot(x[1]),
            height: x[2],
            half: (mass / density).cbrt() / 2.0,
            mass,
        })
        .collect())
}

/// Depth of the lowest point of the first collider, a circle, below the surface of the first body, a half-plane.
fn penetration(job: &Table, run: &Run) -> Result<f64, String> {
    let first = |list: &str| job.get(list)?.as_array()?.first();
    let shape = |list: &str| first(list)?.get("shape");
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|whole| whole as f64));
    let surface = || number(shape("bodies")?.get("point")?.as_array()?.get(1)?);
    let radius = || number(shape("colliders")?.get("radius")?);
    let place = || {
        let column = format!("position_{}_y", first("colliders")?.get("name")?.as_str()?);
        run.history.iter().find(|(name, _)| *name == column).map(|(_, value)| *value)
    };
    let depth = || Some(surface()? - (place()? - radius()?));
    depth().ok_or_else(|| "expected a half-plane of sand and a free circle; found something else".into())
}
