//! The files of a run: outputs, checkpoints and the last picture.
use std::path::PathBuf;
use std::time::Instant;

use super::measures::maps;
use super::names::Names;
use super::scene::{LastState, Scene};
use super::{Run, RunError, restart, scene};
use crate::io::snapshot::{PointField, Scalars, ShownWater, View};
use crate::job::Problem;
use crate::particle::followed::Motion;
use crate::solver::Solver;
use crate::solver::state::phases::Phase;

impl<const D: usize> Run<'_, D> {
    /// Collective. Draws the last state. All results are on disk by now, so a failure is only a message.
    pub(super) fn picture(&self) -> Result<Option<PathBuf>, String> {
        let problem = self.problem;
        let Some(draw) = self.draw.filter(|_| problem.output.picture) else { return Ok(None) };
        let has =
            |name: &str| self.names.histories.iter().any(|names| names.split(' ').any(|own| own == name));
        let plastic = self.solver.physics.materials.iter().any(|material| material.is_plastic());
        let usual = match plastic {
            _ if has("damage") => PointField::Damage,
            true => PointField::PlasticStrain,
            // Between load steps all is at rest.
            false if problem.quasi_static.is_some() => match problem.output.followed.motion {
                Motion::Nothing => PointField::VonMises,
                Motion::Displacement | Motion::Strain => PointField::Displacement,
            },
            false => PointField::Speed,
        };
        let field = problem.output.picture_field.unwrap_or(usual);
        let title = if problem.title.is_empty() { &problem.name } else { &problem.title };
        let path = problem.output.directory.join(format!("{}.png", problem.name));
        let scalars = Scalars::default();
        let view = view(problem, &self.solver, &self.names, &scalars);
        let solids =
            scene::solids(&self.solver.physics.colliders, &self.solver.contacts.states, problem.origin);
        let scene = Scene { solids, boxes: Some(scene::boxes(&self.solver.physics)) };
        draw(self.comm, LastState { view, field, title, scene }, &path)?;
        Ok(Some(path))
    }

    /// Collective. Writes the next output. One that `is_due` by its time keeps its number; any other is
    /// written because the run ends here, and the next output of a run that goes on takes its place.
    pub(super) fn write_output(&mut self, is_due: bool) -> Result<(), RunError> {
        let start = Instant::now();
        let step = Some(self.solver.clock.step);
        let next = self.outputs.next() + u64::from(is_due);
        let scalars = self.scalars(next, step);
        let fields = self.leaf_fields();
        let view = view(self.problem, &self.solver, &self.names, &scalars);
        let view = View { leaf_fields: &fields, ..view };
        self.comm.agree(self.recorder.sync())?;
        self.outputs.write(self.comm, &view)?;
        let maps = if self.comm.rank() == 0 {
            maps::write(self.problem, &self.solver.measured.maxima)
        } else {
            Ok(())
        };
        self.comm.agree(maps)?;
        if !is_due {
            self.outputs.give_back_number();
        }
        self.output_step = step;
        self.solver.phases.book(Phase::Output, start.elapsed());
        Ok(())
    }

    /// Collective. Scalars of a state, beside particles and tree.
    pub(super) fn scalars(&mut self, next_output: u64, output_step: Option<u64>) -> Scalars {
        let mut scalars =
            restart::scalars(self.comm, self.problem, &mut self.solver, next_output, output_step);
        scalars.counts.extend(self.recorder.last_row().map(|step| (restart::ROW_STEP.into(), step)));
        scalars
    }

    /// Collective. Fields of leaves for the file of the tree.
    pub(super) fn leaf_fields(&mut self) -> Vec<(String, Vec<f64>)> {
        let refinement = self.solver.refinement();
        refinement.map_or_else(Vec::new, |refinement| {
            vec![
                ("refinement_indicator".into(), refinement.urgency),
                ("wanted_level".into(), refinement.wanted),
            ]
        })
    }

    /// Collective. Gives the last checkpoint its name if it is on disk, or waits for that. The rows of tables
    /// up to its step are on disk before.
    pub(super) fn settle(&mut self, wait: bool) -> Result<(), RunError> {
        if self.outputs.is_pending() && (wait || self.outputs.is_on_disk(self.comm)) {
            let synced = self.comm.agree(self.recorder.sync());
            // The checkpoint matters more than rows: without them a run can still continue from it.
            self.outputs.settle(self.comm)?;
            synced?;
        }
        Ok(())
    }

    pub(super) fn checkpoint(&mut self) -> Result<PathBuf, RunError> {
        let start = Instant::now();
        self.settle(true)?;
        let scalars = self.scalars(self.outputs.next(), self.output_step);
        let view = view(self.problem, &self.solver, &self.names, &scalars);
        let path = self.outputs.checkpoint(self.comm, &view, self.problem.checkpoint.keep)?;
        self.schedule.checkpoint_written(self.solver.clock.time);
        self.solver.phases.book(Phase::Output, start.elapsed());
        Ok(path)
    }
}

/// The state of a run as files show it.
fn view<'a, const D: usize>(
    problem: &'a Problem<D>,
    solver: &'a Solver<D>,
    names: &'a Names,
    scalars: &'a Scalars,
) -> View<'a, D> {
    View {
        leaves: solver.forest.leaves(),
        chunks: &solver.chunks,
        followed: solver.physics.followed,
        leaf_fields: &[],
        maps: &problem.maps,
        maxima: &solver.measured.maxima,
        origin: problem.origin,
        root_edge: problem.root_edge,
        brick: problem.brick,
        materials: &names.materials,
        water_moduli: &names.water_moduli,
        water: solver.physics.water_at(solver.clock.time).map(|(load, water)| ShownWater {
            water,
            since: load.start,
            gravity: solver.physics.gravity.at(solver.clock.time),
        }),
        bodies: &names.bodies,
        histories: &names.histories,
        job_digest: problem.digest,
        job_text: &problem.text,
        job_file: &names.job_file,
        step: solver.clock.step,
        time: solver.clock.time,
        dt: solver.clock.dt,
        scalars,
    }
}
