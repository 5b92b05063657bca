//! Problem 17: a block at rest on a floor.
use crate::page::Page;
use crate::runs::Runs;

/// Edge of the cells, m.
const CELL: f64 = 0.0625;

pub(crate) fn section(runs: &Runs, page: &mut Page) {
    page.text(
        "## 17 A block at rest on a floor\n\n\
         An elastic block of 8 x 8 cells falls from a cell above a [floor](../jobs/verification/rest_on_floor.toml) or a \
         [face of the domain](../jobs/verification/rest_on_face.toml) and comes to rest. Exact: its lower face is at the surface, and its two lowest rows of particles carry the weight of what lies over their middle. \
         *Height* is that of the surface over a row of nodes. Exercises contact at the surface on nodes. It is limited by what landing leaves between both rows.\n",
    );
    let cases: &[(f64, Option<f64>)] = match runs.is_full() {
        true => &[
            (1e5, None),
            (1e6, None),
            (1e8, None),
            (1e5, Some(0.0)),
            (1e6, Some(0.0)),
            (1e8, Some(0.0)),
            (1e6, Some(0.25)),
            (1e6, Some(0.5)),
            (1e8, Some(0.5)),
            (1e6, Some(0.96)),
        ],
        false => &[(1e6, None), (1e6, Some(0.5))],
    };
    let mut rows = Vec::new();
    for &(young, height) in cases {
        let (job, name) = match height {
            None => ("verification/rest_on_face", "face".to_owned()),
            Some(height) => ("verification/rest_on_floor", format!("floor.{height}")),
        };
        let surface = height.map_or(0.0, |height| 0.25 + height * CELL);
        let mut settings = vec![format!("materials[0].young={young:e}")];
        if height.is_some() {
            settings.push(format!("colliders[0].shape.max=[3,{surface}]"));
            settings.push(format!("bodies[0].shape.min=[0.5,{}]", surface + CELL));
            settings.push(format!("bodies[0].shape.max=[1,{}]", surface + 9.0 * CELL));
            settings.push(format!("probes[1].shape.max=[0.9,{}]", surface + 1.02 * CELL));
        }
        let name = format!("{name}.{young:e}");
        let results = runs.run(job, &format!("rest_{name}"), &settings);
        let history = results.history(["least_block_y", "stress_rows_yy"]);
        let [least, stress] = *history.last().expect("rows");
        let gap = (least - 0.25 * CELL - surface) / CELL;
        let stress = stress / (-9810.0 * 7.5 * CELL);
        page.line(&format!("rest.gap.{name}"), gap);
        page.line(&format!("rest.stress.{name}"), stress);
        let place = height.map_or("face".to_owned(), |height| format!("floor, {height} cells"));
        rows.push(vec![place, format!("{young:.0e}"), format!("{gap:.4}"), format!("{stress:.4}")]);
    }
    page.table(&["surface", "E, Pa", "gap, cells", "stress over exact"], &rows);
}
