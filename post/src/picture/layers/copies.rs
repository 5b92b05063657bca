//! Copies of what is drawn: images behind planes of symmetry, and bodies of revolution in space.

use crate::picture::camera::Bounds;
use crate::picture::drawing::Drawing;
use crate::picture::layers::solids;
use crate::picture::scene::{LARGER, Splat};
use crate::picture::settings::Settings;
use crate::revolve::{self, Revolve};
use agimp::io::snapshot::Header;

impl Drawing {
    /// The bodies of revolution in space of a plane drawing, without leaves.
    ///
    /// # Errors
    /// In words: see [`revolve::copies`].
    pub(in crate::picture) fn revolved(self, header: &Header, revolve: Revolve) -> Result<Self, String> {
        let Self { splats, mut vectors, domain: Bounds { low, high }, .. } = self;
        let sections = splats.iter().map(|splat| (splat.position[0], splat.radii[0] / LARGER));
        let copies = revolve::copies(header, sections, revolve)?;
        if !vectors.each.is_empty() {
            vectors.each = copies.iter().map(|&(p, turn)| turn.vector(vectors.each[p])).collect();
        }
        let copied = copies.iter().map(|&(p, turn)| {
            let Splat { position, radii: [radius, height, _], value } = splats[p];
            Splat { position: turn.place(position), radii: [radius, radius, height], value }
        });
        let (splats, reach) = (copied.collect(), high[0]);
        let domain = Bounds { low: [-reach, -reach, low[1]], high: [reach, reach, high[1]] };
        let solids = self.solids.into_iter().map(|solid| solids::revolved(solid, revolve)).collect();
        Ok(Self { flat: false, domain, splats, vectors, solids, leaves: Vec::new(), ..self })
    }

    /// Adds the mirror images behind planes of symmetry. Returns the frame of all.
    pub(in crate::picture) fn mirror(&mut self, settings: &Settings, mut frame: Bounds) -> Bounds {
        for axis in (0..3).filter(|&axis| settings.mirror[axis]) {
            let plane = self.domain.low[axis];
            let behind: Vec<Splat> = self
                .splats
                .iter()
                .map(|splat| {
                    let mut image = *splat;
                    image.position[axis] = 2.0 * plane - image.position[axis];
                    image
                })
                .collect();
            self.splats.extend(behind);
            let behind: Vec<[f64; 3]> = self
                .vectors
                .each
                .iter()
                .map(|vector| std::array::from_fn(|i| if i == axis { -vector[i] } else { vector[i] }))
                .collect();
            self.vectors.each.extend(behind);
            let images: Vec<_> = self
                .leaves
                .iter()
                .map(|(corner, edge)| {
                    let mut image = *corner;
                    image[axis] = 2.0 * plane - image[axis] - edge;
                    (image, *edge)
                })
                .collect();
            self.leaves.extend(images);
            self.solids = std::mem::take(&mut self.solids)
                .into_iter()
                .map(|solid| solids::mirrored(solid, axis, plane))
                .collect();
            frame.low[axis] = 2.0 * plane - frame.high[axis];
        }
        frame
    }
}
