//! `agimp report`: one page says what a run has done, finished or not, with the numbers of its files.
//!
//! The test that opens a browser needs Chromium; without it the test says so and passes. `AGIMP_CHROMIUM`
//! names another one than that of the path.

use std::path::Path;
use std::process::Command;

use crate::common::launch::signal;
use crate::common::program::{RUBBER_BLOCK, agimp, chromium, finished, succeed, told};

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
[[lines]]
name = "row"
from = [0.3, 0.1]
to = [0.7, 0.1]
points = 9
quantities = ["velocity"]
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
    for chart in [
        "Energy",
        "Momentum",
        "Extent of top",
        "Force on plate",
        "Force on plate along y over its displacement",
    ] {
        assert!(page.contains(&format!("<b>{chart}</b>")), "a chart {chart}");
    }
    assert!(page.matches("<svg").count() >= 8);
    // Along the line the rubber is pressed down, at the end more than at the start, where nothing moves.
    assert!(page.contains("<b>velocity y along row</b>") && page.contains(">t = 0 s</span>"));
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

/// The block flies up and through a face that nobody has opened, and that holds nodes alone.
#[test]
fn a_run_that_fails_has_a_page_that_says_why_and_from_where_to_go_on() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let here = directory.path();
    let block = RUBBER_BLOCK.replace(
        "min = [0.25, 0.0], max = [0.75, 0.25] }",
        "min = [0.25, 0.25], max = [0.75, 0.5] }\nvelocity = [0, 100]",
    );
    let block = block.replace("[boundaries]\n", "[boundaries]\ny_max = { kind = 'symmetric' }\n");
    let job = JOB.replace("min = [0, 0.25], max = [1, 0.4]", "min = [0, 0.05], max = [1, 0.1]");
    let job = job.replace("every = 0.005", "every = 0.002");
    std::fs::write(here.join("press.toml"), [job, block].concat()).expect("written");
    let run = |options: &[&str]| {
        agimp(here, &[&["run", "press.toml", "--set", "output.report=true"], options].concat())
    };
    let output = run(&[]);
    assert_eq!(output.status.code(), Some(1), "{}", told(&output));
    assert!(told(&output).contains("report   out/press/press.report.html"), "{}", told(&output));
    let failed = page(here);
    assert!(failed.contains("class=\"state failed\"") && failed.contains("failed at"), "its state");
    for part in ["<b>Why it ended:</b> step ", "left the domain at", "<b>What to do:</b>"] {
        assert!(failed.contains(part), "{part}");
    }
    let last = std::fs::read_dir(here.join("out/press")).expect("results").flatten();
    let last = last.filter_map(|entry| entry.file_name().into_string().ok());
    let last =
        last.filter(|name| name.starts_with("press_") && !name.contains("tree")).max().expect("an output");
    assert!(failed.contains(&format!("<b>Last state:</b> <code>out/press/{last}</code>, t = ")), "{last}");
    let (_, command) = failed.split_once("<code>agimp run ").expect("a command to go on");
    let command = command.split_once("</code>").expect("its end").0;
    assert!(command.ends_with("press.toml --restart latest"), "{command}");
    assert_eq!(failed.matches("data:image/png;base64,").count(), 4, "pictures as far as there are outputs");
    // The same later, with another eye.
    succeed(here, &["report", "out/press", "--colour", "velocity_y"]);
    assert!(page(here).contains("left the domain at") && page(here).contains("Coloured by velocity y"));
    // The record of the end lasts no longer than that.
    let output =
        agimp(here, &["run", "press.toml", "--set", "output.report=true", "--end", "0.005", "--quiet"]);
    assert!(output.status.success(), "{}", told(&output));
    assert!(page(here).contains("class=\"state finished\"") && !page(here).contains("left the domain"));
    assert!(!here.join("out/press/press.ended.json").exists());
}

#[test]
fn a_run_that_is_stopped_has_a_page_that_names_its_checkpoint() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let here = directory.path();
    std::fs::write(here.join("press.toml"), job()).expect("written");
    let words = ["run", "press.toml", "--quiet", "--end", "1e3", "--set", "output.report=true"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_agimp"))
        .args(words)
        .args(["--set", "output.every=1e3", "--set", "colliders.plate.motion.velocity=[0, 0]"])
        .current_dir(here)
        .spawn()
        .expect("starts");
    let rows = || {
        std::fs::read_to_string(here.join("out/press/press.history.csv"))
            .map_or(0, |text| text.lines().count())
    };
    while rows() < 5 {
        assert!(child.try_wait().expect("a child").is_none(), "it runs on");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    signal(child.id(), "TERM");
    assert_eq!(child.wait().expect("it ends").code(), Some(3));
    let page = page(here);
    assert!(page.contains("class=\"state ended\"") && page.contains("stopped at"), "its state");
    assert!(page.contains("stopped on request") && page.contains("press.checkpoint_0"), "its checkpoint");
}

/// The block of results at the end: each of its commands does what it says.
#[test]
fn the_commands_at_the_end_of_a_run_work() {
    let directory = tempfile::tempdir().expect("temporary directory");
    let here = directory.path();
    std::fs::write(here.join("press.toml"), job()).expect("written");
    // A name that a shell would take apart.
    let output = agimp(here, &["run", "press.toml", "--out", "it's here"]);
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{}", told(&output));
    assert!(shown.contains("took     ") && shown.contains("history  it's here/press.history.csv"), "{shown}");
    let commands: Vec<&str> = shown.lines().filter_map(|line| Some(&line[line.find("agimp ")?..])).collect();
    assert_eq!(commands.len(), 4, "{shown}");
    let program = Path::new(env!("CARGO_BIN_EXE_agimp")).parent().expect("a directory");
    let paths = format!("{}:{}", program.display(), std::env::var("PATH").expect("a path"));
    for command in commands {
        let output = Command::new("sh").args(["-c", command]).env("PATH", &paths).current_dir(here).output();
        let output = output.expect("a shell");
        assert!(output.status.success(), "{command}: {}", told(&output));
    }
    for made in ["press.html", "press_000004.png", "press.movie.png", "press.report.html"] {
        assert!(here.join("it's here").join(made).is_file(), "{made}");
    }
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
        (&["none.hdf"], "none.hdf: found no such file; expected the directory of a run"),
        (&["two/a.history.csv"], "two/a.history.csv: found a file that holds no state of a run"),
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
