//! `agimp report`: one page says what a run has done, finished or not, with the numbers of its files.
//!
//! The test that opens a browser needs Chromium; without it the test says so and passes. `AGIMP_CHROMIUM` names another
//! one than that of the path.
#[path = "common/program.rs"]
mod program;

use std::path::Path;
use std::process::Command;

use program::{RUBBER_BLOCK, agimp, chromium, finished, told};

/// A plate is pressed into the block of rubber.
const JOB: &str = r#"
version = 1
title = "Block & <plate>"
dimension = 2
gravity = [0, -9.81]
[[colliders]]
name = "plate"
shape = { kind = "box", min = [0, 0.25], max = [1, 0.4] }
motion = { kind = "steady", velocity = [0, -0.5] }
contact = { kind = "slip" }
[[probes]]
name = "top"
quantities = ["extent"]
[history]
every_steps = 1
[time]
end = 0.02
[output]
every = 0.005
picture = false
"#;

fn job() -> String {
    [JOB, RUBBER_BLOCK].concat()
}

fn page(directory: &Path) -> String {
    std::fs::read_to_string(directory.join("out/press/press.report.html")).expect("the page")
}

/// Column of the history, its last value.
fn last(directory: &Path, column: &str) -> f64 {
    let text = std::fs::read_to_string(directory.join("out/press/press.history.csv")).expect("history");
    let place = text
        .lines()
        .next()
        .expect("header")
        .split(',')
        .position(|cell| cell.split(' ').next() == Some(column));
    let row = text.lines().last().expect("a row");
    row.split(',').nth(place.expect("the column")).expect("a cell").parse().expect("a number")
}

/// Values of a row of the table of numbers: start, end, least, greatest.
fn numbers(page: &str, column: &str) -> Vec<f64> {
    let (_, row) = page.split_once(&format!("<td><code>{column}</code></td>")).expect("a row of the table");
    let cells = row.split_once("</tr>").expect("its end").0.split("</td>");
    cells.take(4).map(|cell| cell.trim_start_matches("<td>").parse().expect("a number")).collect()
}

#[test]
fn a_finished_run_has_its_pictures_curves_numbers_and_job_on_one_page() {
    let directory = finished("press", &job(), &["--set", "output.report=true"]);
    let page = page(directory.path());
    assert!(page.contains("<title>Block &amp; &lt;plate&gt;</title>"));
    assert!(page.contains("class=\"state finished\""), "it has finished");
    // The plate has gone down by its speed times the time.
    let time = last(directory.path(), "time");
    let [start, end, least, most] = numbers(&page, "position_plate_y")[..] else { panic!("four numbers") };
    assert!((end - (start - 0.5 * time)).abs() < 1e-5, "{start} {end}");
    assert_eq!((least, most), (end, start));
    let force = numbers(&page, "force_plate_y");
    assert!((force[1] - last(directory.path(), "force_plate_y")).abs() < 1e-4 * force[1].abs(), "{force:?}");
    for chart in
        ["Energy", "Momentum", "Extent of top", "Force on plate", "Force on plate along y over its way"]
    {
        assert!(page.contains(&format!("<b>{chart}</b>")), "a chart {chart}");
    }
    assert!(page.matches("<svg").count() >= 8);
    // From the first output to the last, the last one among them.
    assert_eq!(page.matches("data:image/png;base64,").count(), 4);
    assert!(page.contains("press_000000.hdf") && page.contains("press_000004.hdf"));
    assert!(page.contains("particles to grid (P2G)"), "where the time went");
    assert!(page.contains("y_min = { kind = &quot;sticky&quot; }"), "the job");
    // It is one file, and asks nobody.
    for word in ["http:", "https:", "src=\"/", "url(", "<script"] {
        assert!(!page.replace("http://www.w3.org/2000/svg", "").contains(word), "{word}");
    }
    // Again from the command line, with pictures of another quantity.
    let output =
        agimp(directory.path(), &["report", "press.toml", "--colour", "pressure", "--pictures", "2"]);
    assert!(output.status.success(), "{}", told(&output));
    let again = self::page(directory.path());
    assert!(again.contains("Coloured by pressure") && again.matches("data:image/png;base64,").count() == 2);
}

/// As a run that was killed leaves it: no report, half a row.
#[test]
fn a_run_that_was_killed_is_shown_as_far_as_it_came() {
    let directory = finished("press", &job(), &[]);
    let results = directory.path().join("out/press");
    assert!(!results.join("press.report.html").exists(), "only if the job asks");
    std::fs::remove_file(results.join("press.report.json")).expect("removed");
    let history = std::fs::read_to_string(results.join("press.history.csv")).expect("history");
    let rows: Vec<&str> = history.lines().collect();
    let half = rows[..rows.len() / 2].join("\n") + "\n100,0.0";
    std::fs::write(results.join("press.history.csv"), half).expect("written");
    let output = agimp(directory.path(), &["report", "out/press"]);
    assert!(output.status.success(), "{}", told(&output));
    let page = page(directory.path());
    assert!(page.contains("class=\"state ended\"") && page.contains("of 20 ms"), "it has not finished");
    let time: f64 = rows[rows.len() / 2 - 1].split(',').nth(1).expect("the time").parse().expect("a number");
    assert!((numbers(&page, "time")[1] / time - 1.0).abs() < 1e-5, "the last whole row");
}

#[test]
fn what_is_no_run_is_refused_with_a_word_of_what_to_do() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let here = directory.path();
    std::fs::write(here.join("press.toml"), job()).expect("written");
    std::fs::create_dir(here.join("two")).expect("made");
    for name in ["a", "b"] {
        std::fs::write(here.join(format!("two/{name}.history.csv")), "step,time [s]\n").expect("written");
    }
    for (words, message) in [
        (&["."][..], ".: found no history of a run (NAME.history.csv)"),
        (&["press.toml"], "out/press: found no history of a run (NAME.history.csv); expected the directory"),
        (&["press.toml"], "run the job (agimp run press.toml)"),
        (&["none.toml"], "none.toml"),
        (&["two"], "two: found the results of a, b; choose one with --name"),
        (&["two", "--name", "c"], "found no history of a run"),
        (&["two", "--name", "a", "--out", "no/such/place.html"], "cannot write"),
    ] {
        let output = agimp(here, &[&["report"], words].concat());
        assert_eq!(output.status.code(), Some(2), "{words:?}: {}", told(&output));
        assert!(told(&output).contains(message), "{words:?}: {}", told(&output));
    }
    // A run without a row yet has a page too.
    let output = agimp(here, &["report", "two", "--name", "a"]);
    assert!(output.status.success(), "{}", told(&output));
}

#[test]
fn browser_shows_the_page_without_complaint() {
    let Some(chromium) = chromium() else { return };
    let directory = finished("press", &job(), &["--set", "output.report=true"]);
    let here = directory.path();
    let output = Command::new(chromium)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--window-size=1200,2400",
        ])
        .args(["--enable-logging=stderr", "--dump-dom"])
        .arg(format!("--user-data-dir={}", here.join("profile").display()))
        .arg(format!("--screenshot={}", here.join("screenshot.png").display()))
        .arg(format!("file://{}", here.join("out/press/press.report.html").display()))
        .output()
        .expect("Chromium starts");
    let log = told(&output);
    assert!(!log.contains("CONSOLE"), "{log}");
    let file = std::fs::File::open(here.join("screenshot.png")).expect("a screenshot");
    let mut picture = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
    let mut pixels = vec![0; picture.output_buffer_size()];
    let info = picture.next_frame(&mut pixels).expect("a picture");
    let coloured = |pixel: &&[u8]| {
        pixel[..3].iter().max().expect("three") - pixel[..3].iter().min().expect("three") > 24
    };
    let coloured = pixels.chunks_exact(info.color_type.samples()).filter(coloured).count();
    assert!(coloured > 50_000, "pictures are drawn: {coloured} coloured pixels");
}
