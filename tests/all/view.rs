//! `agimp view`: the page holds what the files hold, asks nobody, and draws it in a browser.
//!
//! The test that opens a browser needs Chromium; without it the test says so and passes. `AGIMP_CHROMIUM`
//! names another one than that of the path.

use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::program::{RUBBER_MATERIAL, agimp, chromium, finished};
use agimp::io::snapshot::PointField;
use base64::Engine as _;
use post::frame::{Frame, Leaves};
use serde_json::Value;

/// Half of the lower part of a domain of 1 m by 1 m is rubber that moves to the right; cells of two sizes.
const JOB: &str = r#"
version = 1
title = "Half <full>"
dimension = 2
[domain]
min = [-0.5, 2.0]
size = [1, 1]
root_edge = 0.25
[tree]
regions = [{ level = 1, shape = { kind = "box", min = [-0.5, 2.0], max = [0.0, 2.25] } }]
[[bodies]]
name = "block"
material = "rubber"
shape = { kind = "box", min = [-0.5, 2.0], max = [0.0, 2.5] }
velocity = [1, 0]
[time]
end = 0.01
[output]
every = 0.005
picture = false
"#;

/// A directory with a finished run of [`JOB`].
fn run() -> tempfile::TempDir {
    finished("half", &[JOB, RUBBER_MATERIAL].concat(), &[])
}

fn outputs(directory: &Path) -> Vec<PathBuf> {
    (0..3).map(|number| directory.join(format!("out/half/half_{number:06}.hdf"))).collect()
}

/// The page of all times of the run.
fn page(directory: &Path, options: &[&str]) -> String {
    let words = [&["view", "out/half/half.hdf.series", "--out", "page.html"], options].concat();
    let output = agimp(directory, &words);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(directory.join("page.html")).expect("the page")
}

/// The text of an element of the page.
fn element<'a>(page: &'a str, id: &str) -> &'a str {
    let (_, rest) = page.split_once(&format!("id=\"{id}\">")).unwrap_or_else(|| panic!("no element {id}"));
    rest.split_once("</script>").expect("its end").0
}

/// The bytes of a frame or tree.
fn bytes(page: &str, id: &str) -> Vec<u8> {
    let packed = base64::engine::general_purpose::STANDARD.decode(element(page, id)).expect("base64");
    let mut bytes = Vec::new();
    flate2::read::ZlibDecoder::new(&packed[..]).read_to_end(&mut bytes).expect("zlib");
    bytes
}

/// Undoes a column: differences as planes of bytes, the sign in the lowest bit.
fn column(bytes: &mut &[u8], count: usize, width: usize) -> Vec<u64> {
    let (planes, rest) = bytes.split_at(count * width);
    *bytes = rest;
    let mask = if width == 8 { u64::MAX } else { (1 << (8 * width)) - 1 };
    let mut value = 0_u64;
    let mut next = |i: usize| {
        let coded =
            (0..width).fold(0_u64, |sum, byte| sum | u64::from(planes[byte * count + i]) << (8 * byte));
        value = value.wrapping_add((coded >> 1) ^ (coded & 1).wrapping_neg()) & mask;
        value
    };
    (0..count).map(&mut next).collect()
}

fn real(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

#[test]
fn page_holds_positions_values_and_leaves_of_the_files() {
    let directory = run();
    let page = page(directory.path(), &["--fields", "id,velocity,pressure,material", "--bits", "12"]);
    let meta: Value = serde_json::from_str(element(&page, "meta")).expect("JSON");
    let columns: Vec<&str> = meta["columns"]
        .as_array()
        .expect("columns")
        .iter()
        .map(|c| c["name"].as_str().expect("name"))
        .collect();
    assert_eq!(columns, ["id", "velocity_x", "velocity_y", "velocity_z", "speed", "pressure", "material"]);
    assert_eq!(meta["title"], "Half <full>", "that of the job");
    assert_eq!(meta["columns"][5]["unit"], "Pa");
    assert_eq!(meta["columns"][6]["names"], serde_json::json!(["rubber"]));
    let resolution = real(&meta["resolution"]);
    // A 32nd of the half width of the small particles: cells of 31 mm with two along each axis.
    assert!((resolution - 0.25 / 8.0 / 4.0 / 32.0).abs() < 1e-12, "{resolution}");

    for (number, path) in outputs(directory.path()).iter().enumerate() {
        let frame = Frame::read(path, &[PointField::Id], true).expect("readable");
        let count = frame.positions.len();
        let shown = &meta["frames"][number];
        assert_eq!((real(&shown["time"]), real(&shown["particles"])), (frame.header.time, count as f64));

        let data = bytes(&page, &format!("frame-{number}"));
        let data = &mut &data[..];
        let places: [Vec<u64>; 3] = std::array::from_fn(|_| column(data, count, 2));
        let half_widths = column(data, count, 1);
        let ids = column(data, count, 8);
        let levels: Vec<Vec<u64>> = columns[1..].iter().map(|_| column(data, count, 2)).collect();
        assert!(data.is_empty());
        let value = |name: &str, particle: usize| {
            let at = columns.iter().position(|column| *column == name).expect("the column");
            let scale: Vec<f64> =
                meta["columns"][at]["scale"].as_array().expect("scale").iter().map(real).collect();
            let place = levels[at - 1][particle] as f64 / (scale[3] - 1.0);
            scale[0] * (scale[1] + place * (scale[2] - scale[1])).sinh()
        };
        // The page has its own order; identifiers are those of the places at the start.
        let file_ids: Vec<u64> = {
            let file = agimp::io::hdf5_file::Reader::open_alone(path).expect("opens");
            file.read_slab("VTKHDF/PointData/id", 0, count as u64).expect("identifiers")
        };
        let pressures: Vec<f64> = {
            let file = agimp::io::hdf5_file::Reader::open_alone(path).expect("opens");
            file.read_slab("VTKHDF/PointData/pressure", 0, count as u64).expect("pressures")
        };
        let usual = real(&meta["columns"][5]["scale"][0]);
        for (particle, id) in ids.iter().enumerate() {
            let row = file_ids.iter().position(|other| other == id).expect("the particle");
            for axis in 0..2 {
                let low = real(&meta["bounds"][0][axis]);
                let position = low + places[axis][particle] as f64 * resolution;
                assert!((position - frame.positions[row][axis]).abs() <= 0.51 * resolution);
            }
            let half_width = real(&meta["half_width"])
                * (half_widths[particle] as f64 / real(&meta["steps_per_doubling"])).exp2();
            assert!((half_width / frame.half_widths[row] - 1.0).abs() < 0.03);
            let error = (value("pressure", particle) - pressures[row]).abs();
            assert!(error <= 0.005 * (pressures[row].abs() + usual), "{error} {}", pressures[row]);
            assert!(pressures[row] != 0.0 || error < 1e-9 * usual, "zero is kept");
        }

        // The tree stands still and is there once.
        let leaves = Leaves::of_output(path).expect("leaves");
        assert_eq!(shown["tree"], 0);
        assert_eq!(shown["leaves"], leaves.levels.len());
        if number == 0 {
            let data = bytes(&page, "tree-0");
            let data = &mut &data[..];
            let levels: Vec<u8> = column(data, leaves.levels.len(), 1).into_iter().map(|l| l as u8).collect();
            let coords: [Vec<u64>; 3] = std::array::from_fn(|_| column(data, levels.len(), 4));
            assert_eq!(levels, leaves.levels);
            for (i, coord) in leaves.coords.iter().enumerate() {
                assert_eq!(std::array::from_fn(|axis| coords[axis][i] as u32), *coord);
            }
            let area: f64 = levels.iter().map(|&level| 0.0625 / f64::from(1_u32 << (2 * level))).sum();
            assert_eq!(area, 1.0, "leaves fill the domain");
        }
    }
    assert!(!page.contains("id=\"tree-1\""));
}

#[test]
fn page_is_one_file_that_names_no_other_and_no_markup_of_titles() {
    let directory = run();
    let page = page(directory.path(), &["--title", "a </script><b> & \"c\""]);
    for word in ["http:", "https:", "src=", "url(", "@import", "fetch("] {
        assert!(!page.contains(word), "{word}");
    }
    assert!(page.contains("default-src 'none'"), "a policy that forbids the network");
    assert!(page.contains("<title>a &lt;/script&gt;&lt;b&gt; &amp; &quot;c&quot;</title>"));
    let meta: Value = serde_json::from_str(element(&page, "meta")).expect("JSON");
    assert_eq!(meta["title"], "a </script><b> & \"c\"");
}

/// Bodies of revolution come to be all around the axis, z; those of other jobs are refused.
#[test]
fn bodies_of_revolution_are_shown_in_space() {
    let job = "version = 1\ndimension = 2\ngeometry = 'axisymmetric'\n[domain]\nsize = [1, 1]\nroot_edge = 0.5\n\
        [[bodies]]\nname = 'disk'\nmaterial = 'rubber'\nvelocity = [0, 1]\n\
        shape = { kind = 'box', min = [0, 0.25], max = [0.5, 0.5] }\n\
        [time]\nend = 0.01\n[output]\npicture = false\n";
    let words = |name: &str| {
        ["view".to_owned(), format!("out/{name}/{name}.hdf.series"), "--revolve=whole".to_owned()]
    };
    let view = |directory: &Path, name: &str| {
        let words = words(name);
        let words: Vec<&str> = words.iter().map(String::as_str).chain(["--out", "page.html"]).collect();
        agimp(directory, &words)
    };
    let directory = finished("disk", &[job, RUBBER_MATERIAL].concat(), &[]);
    let output = view(directory.path(), "disk");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let page = std::fs::read_to_string(directory.path().join("page.html")).expect("the page");
    let meta: Value = serde_json::from_str(element(&page, "meta")).expect("JSON");
    assert_eq!(meta["dimension"], 3);
    assert_eq!(meta["frames"][0]["leaves"], 0);
    for (axis, [low, high]) in [[-0.5, 0.5], [-0.5, 0.5], [0.25, 0.51]].into_iter().enumerate() {
        let bounds = [0, 1].map(|side: usize| real(&meta["bounds"][side][axis]));
        assert!((bounds[0] - low).abs() < 0.05 && (bounds[1] - high).abs() < 0.05, "{axis}: {bounds:?}");
    }
    let plane = run();
    let output = view(plane.path(), "half");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && words.contains("found no bodies of revolution"), "{words}");
}

#[test]
fn what_cannot_be_shown_is_refused_and_writes_nothing() {
    let directory = run();
    let here = directory.path();
    std::fs::write(here.join("not.hdf"), "a file of plain text").expect("written");
    std::fs::write(here.join("empty.hdf.series"), r#"{"file-series-version":"1.0","files":[]}"#)
        .expect("written");
    std::fs::create_dir(here.join("bare")).expect("made");
    let output = "out/half/half_000000.hdf";
    for (words, message) in [
        (&["none.hdf"][..], "none.hdf"),
        (&["not.hdf"], "not an HDF5 file"),
        (&["none.hdf.series"], "found no index of outputs"),
        (&["empty.hdf.series"], "the index lists no outputs"),
        (
            &["out/half/half_000000.tree.hdf"],
            "found the tree of a run, which holds no particles; expected its outputs: out/half/half_000000.hdf",
        ),
        (&["."], ".: the index of empty lists no outputs"),
        (&["bare"], "bare: found no outputs of a run"),
        (&[output, "--fields", "stress"], "does not contain stress; it contains "),
        (&[output, "--fields", "presure"], "expected one of velocity, displacement, strain"),
        (&[output, "--bits", "40"], "40 is not in 4..=16"),
        (&[output, "--out", "no/such/place.html"], "cannot write"),
    ] {
        let output = agimp(here, &[&["view"], words].concat());
        let told = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{words:?}: {told}");
        assert!(told.contains(message), "{words:?}: {told}");
    }
    let pages = || std::fs::read_dir(here.join("out/half")).expect("directory").filter_map(Result::ok);
    assert!(pages().all(|entry| !entry.file_name().to_string_lossy().contains("html")));
}

/// Opens the page in a browser without a window, runs `script` in it when it is ready (`v` is the viewer),
/// and returns what the script returns and how many pixels of the screenshot are coloured.
fn in_browser(chromium: &str, directory: &Path, page: &str, script: &str) -> (Value, usize) {
    let ending = format!(
        "<script>(async () => {{ \
           while (!document.documentElement.dataset.state) await new Promise((done) => setTimeout(done, 20)); \
           const v = window.agimpView; let result; \
           const coloured = ({{ scene: {{ gl, canvas }} }}) => {{ \
             const pixels = new Uint8Array(4 * canvas.width * canvas.height); let count = 0; \
             gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels); \
             for (let i = 0; i < pixels.length; i += 4) {{ \
               const pixel = pixels.subarray(i, i + 3); count += Math.max(...pixel) - Math.min(...pixel) > 24; \
             }} \
             return count; \
           }}; \
           try {{ result = await (async () => {{ {script} }})(); }} catch (error) {{ result = String(error); }} \
           document.body.dataset.result = JSON.stringify([document.documentElement.dataset.state, result]); \
         }})();</script></body>"
    );
    std::fs::write(directory.join("driven.html"), page.replace("</body>", &ending)).expect("written");
    let output = Command::new(chromium)
        .args(["--headless=new", "--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--hide-scrollbars", "--window-size=1000,700", "--force-device-scale-factor=1"])
        .args(["--enable-logging=stderr", "--virtual-time-budget=60000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", directory.join("profile").display()))
        .arg(format!("--screenshot={}", directory.join("screenshot.png").display()))
        .arg(format!("file://{}", directory.join("driven.html").display()))
        .output()
        .expect("Chromium starts");
    let (dom, log) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let console: Vec<&str> = log.lines().filter(|line| line.contains("CONSOLE")).collect();
    assert!(console.is_empty(), "{console:#?}");
    let result = dom.split_once("data-result=\"").unwrap_or_else(|| panic!("no result\n{log}")).1;
    let result = result.split_once('"').expect("its end").0.replace("&quot;", "\"");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result[0], "ready", "{result}");

    let file = std::fs::File::open(directory.join("screenshot.png")).expect("a screenshot");
    let mut picture = png::Decoder::new(std::io::BufReader::new(file)).read_info().expect("PNG");
    let mut pixels = vec![0; picture.output_buffer_size()];
    let info = picture.next_frame(&mut pixels).expect("a picture");
    let (width, channels) = (info.width as usize, info.color_type.samples());
    // Without the panel beside and the line below; greys are axes and words.
    let coloured = |(place, pixel): &(usize, &[u8])| {
        let spread = pixel[..3].iter().max().expect("three") - pixel[..3].iter().min().expect("three");
        place % width < width - 245 && place / width > 150 && spread > 24
    };
    let coloured = pixels.chunks_exact(channels).enumerate().filter(coloured).count();
    (result[1].clone(), coloured)
}

#[test]
fn browser_draws_the_particles_where_they_are_and_reads_their_values() {
    let Some(chromium) = chromium() else { return };
    let directory = run();
    let page = page(directory.path(), &["--title", "Half"]);
    // The block by its material; the middle of the screen shows its upper right quarter.
    let script = "
        v.state.dark = false; v.state.field = meta.columns.findIndex((column) => column.name === 'material');
        await v.changed('field'); await v.go(2);
        const { pixels, project } = v.view();
        const place = project([0.125, 0.125, 0]);
        const picked = v.pick(place.x, place.y);
        v.state.axes = false; v.state.picked = undefined; v.drawNow();
        return { metre: pixels, rows: picked.rows, title: document.title, now: element('now').textContent, area: coloured(v) };";
    let (result, coloured) = in_browser(&chromium, directory.path(), &page, script);
    assert_eq!(result["title"], "Half");
    // The run ends with the first step that reaches 0.01 s.
    let now = result["now"].as_str().expect("text");
    assert!(now.starts_with("3 of 3: 0.01"), "{now}");
    let row = |name: &str| {
        let rows = result["rows"].as_array().expect("rows");
        let found = rows.iter().find(|row| row[0] == name).unwrap_or_else(|| panic!("no {name} in {rows:?}"));
        found[1].as_str().expect("text").to_owned()
    };
    // 0.125 m from the lower corner of the box round the particles, to within a particle.
    let at = |name: &str| row(name).parse::<f64>().expect("a number");
    assert!((at("x [m]") + 0.36).abs() < 0.02, "{}", row("x [m]"));
    assert!((at("y [m]") - 2.13).abs() < 0.02, "{}", row("y [m]"));
    // The wall holds the rubber that moves away at 1 m/s: behind the wave of 11.6 m/s it is stretched by 9 %.
    assert!((900.0..=1001.0).contains(&at("density [kg/m³]")), "{}", row("density [kg/m³]"));
    assert_eq!(row("material"), "rubber");
    // Half a metre by half a metre is coloured.
    let area = 0.25 * real(&result["metre"]) * real(&result["metre"]);
    assert!((real(&result["area"]) / area - 1.0).abs() < 0.08, "{} pixels of {area}", result["area"]);
    assert!(coloured > 20_000, "the screenshot shows it too: {coloured}");

    // Cut in the middle of the domain, at x = 0: nothing is to its right; the other side has next to nothing
    // left.
    let cut = "v.state.dark = false; v.state.cutAxis = 'x'; v.state.cutFlip = true; v.state.axes = false;
        v.state.field = meta.columns.findIndex((column) => column.name === 'material');
        await v.changed('field'); await v.go(0); v.drawNow(); return coloured(v);";
    let (left, _) = in_browser(&chromium, directory.path(), &page, cut);
    assert!(real(&left) < 0.02 * area, "{left} of {area}");
}

/// The page in a small window, with a title that does not fit into a line: all numbers of both axes are
/// there, from end to end of the domain, none over another, over the legend or outside.
#[test]
fn browser_shows_all_numbers_of_axes_and_no_text_over_another() {
    let Some(chromium) = chromium() else { return };
    let directory = run();
    let title = "a title of many words ".repeat(40);
    let page = page(directory.path(), &["--title", &title]);
    let script = "
        v.state.field = meta.columns.findIndex((column) => column.name === 'density');
        await v.changed('field'); await v.go(2); v.fit(); v.drawNow();
        const { ticks, taken, width, height } = v.labels;
        const fitted = ticks.map(({ axis, words, box }) => ({ axis, words, box }));
        v.camera.zoom(0.3); v.fitted = false; v.drawNow();
        return { fitted, taken, width, height, near: v.labels.ticks.map(({ axis, words }) => ({ axis, words })), colours:
          new Set(Array.from({ length: 40 }, (_, i) => classColour(i).join())).size };";
    let (result, _) = in_browser(&chromium, directory.path(), &page, script);
    let boxes = |list: &Value| -> Vec<[f64; 4]> {
        let list = list.as_array().expect("a list").iter();
        list.map(|numbers| std::array::from_fn(|i| real(&numbers[i]))).collect()
    };
    let ticks = result["fitted"].as_array().expect("ticks");
    let of_axis = |axis: u64, ticks: &[Value]| -> Vec<f64> {
        let ticks = ticks.iter().filter(|tick| tick["axis"] == axis);
        ticks.map(|tick| tick["words"].as_str().expect("text").parse().expect("a number")).collect()
    };
    for (axis, low) in [(0, -0.5), (1, 2.0)] {
        let numbers = of_axis(axis, ticks);
        assert!(numbers.len() >= 4, "{numbers:?}");
        let step = numbers[1] - numbers[0];
        assert!((numbers[0] - low).abs() < step && numbers.is_sorted(), "{numbers:?}");
        let even = |pair: &[f64]| (pair[1] - pair[0] - step).abs() < 1e-9;
        assert!(numbers.windows(2).all(even), "none is missing: {numbers:?}");
        // Of a part of the plane the numbers of that part.
        let near = of_axis(axis, result["near"].as_array().expect("ticks"));
        assert!(near.len() >= 2 && near[1] - near[0] < step, "{near:?} after {numbers:?}");
    }
    let of_ticks: Vec<Value> = ticks.iter().map(|tick| tick["box"].clone()).collect();
    let own = boxes(&Value::Array(of_ticks));
    // Of others the edges are kept, with a margin.
    let others =
        boxes(&result["taken"]).into_iter().map(|[a, b, c, d]| [a + 4.0, b + 4.0, c - a - 8.0, d - b - 8.0]);
    let all: Vec<[f64; 4]> = own.iter().copied().chain(others).collect();
    for (i, [x, y, width, height]) in all.iter().enumerate() {
        let inside = *x >= 0.0
            && *y >= 0.0
            && x + width <= real(&result["width"])
            && y + height <= real(&result["height"]);
        assert!(inside, "{:?} is outside", all[i]);
        for other in all.iter().take(i.min(own.len())) {
            let apart = x + width <= other[0]
                || other[0] + other[2] <= *x
                || y + height <= other[1]
                || other[1] + other[3] <= *y;
            assert!(apart, "{:?} over {other:?}", all[i]);
        }
    }
    assert_eq!(result["colours"], 40, "forty bodies have forty colours");
}
