use super::*;

const JOB: &str = include_str!("../../jobs/column_collapse.toml");

fn digest(text: &str) -> u64 {
    match parse(text, "job.toml".as_ref()) {
        Ok(AnyProblem::Three(problem)) => problem.digest,
        other => panic!("{other:?}"),
    }
}

#[test]
fn digest_is_of_what_changes_the_state() {
    let same =
        [("title = \"", "title = \"A "), ("every = 0.045", "every = 0.01"), ("end = 0.45", "end = 0.9")];
    for (from, to) in same {
        assert!(JOB.contains(from));
        assert_eq!(digest(JOB), digest(&JOB.replace(from, to)), "{to}");
    }
    let other = [
        ("young = 3e5", "young = 4e5"),
        ("cfl = 0.5", "cfl = 0.4"),
        ("-9.81]", "-9.8]"),
        ("level = 2", "level = 3"),
    ];
    for (from, to) in other {
        assert!(JOB.contains(from));
        assert_ne!(digest(JOB), digest(&JOB.replace(from, to)), "{to}");
    }
    // Comments and the notation of numbers do not belong to the state.
    assert_eq!(digest(JOB), digest(&JOB.replace("young = 3e5", "young = 300000 # Pa")));
}

#[test]
fn coordinates_are_relative_to_the_lower_corner() {
    let Ok(AnyProblem::Three(problem)) = parse(JOB, "job.toml".as_ref()) else { panic!("not a 3D job") };
    assert_eq!(problem.name, "job");
    assert_eq!(problem.origin, [-0.288, -0.288, 0.0]);
    assert_eq!(problem.brick.roots, [6, 6, 1]);
    assert!((problem.bodies[0].centre[0] - 0.288).abs() < 1e-15);
    assert_eq!(problem.probes[0].foot, Some([0.288, 0.288, 0.0]));
}

/// The schema has the limits of the tree.
#[test]
fn deepest_level_in_the_schema_is_the_trees() {
    let schema = schema();
    for pointer in ["/$defs/Tree/properties/base_level/maximum", "/$defs/Region/properties/level/maximum"] {
        assert_eq!(schema.pointer(pointer).and_then(|v| v.as_u64()), Some(u64::from(partition::MAX_LEVEL)));
    }
}

#[test]
fn text_that_is_not_toml_is_a_fault_with_a_place() {
    let faults = parse("version = 1\n[domain\n", "job.toml".as_ref()).unwrap_err();
    assert_eq!(faults.len(), 1);
    assert!(faults[0].span.start >= 12, "{faults:?}");
}

/// Included tables are those of the job; faults in them name their file, and faults in the job name the job.
#[test]
fn faults_of_included_files_name_these() {
    let directory = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(directory.path().join(name), text).unwrap();
    let start = JOB.find("[[materials]]").unwrap();
    let end = start + JOB[start..].find("[[bodies]]").unwrap();
    let materials = format!("# Sand.\n{}", &JOB[start..end]);
    let rest = [&JOB[..start], &JOB[end..]].concat();
    let job = rest.replace("version = 1", "version = 1\ninclude = [\"materials.toml\"]");
    let path = directory.path().join("column_collapse.toml");
    let text = |job: &str, materials: &str| {
        write("materials.toml", materials);
        write("column_collapse.toml", job);
        load(&path).map(|problem| problem.digest()).map_err(|error| error.to_string())
    };
    // The order of the tables of a job does not matter, and neither does the file in which they stand.
    assert_eq!(text(&job, &materials), Ok(digest(JOB)));
    let line = 1 + materials[..materials.find("density").unwrap()].matches('\n').count();
    let wrong = text(&job, &materials.replace("density = ", "density = -")).unwrap_err();
    assert!(wrong.contains(&format!("materials.toml:{line}:11: materials[0].density")), "{wrong}");
    let wrong = text(&job, &materials.replace("density", "densty")).unwrap_err();
    assert!(wrong.contains(&format!("materials.toml:{line}:1: materials[0].densty")), "{wrong}");
    let line = 1 + job[..job.find("[time]").unwrap()].matches('\n').count();
    let wrong = text(&job.replace("[time]", "[time]\nedn = 1"), &materials).unwrap_err();
    assert!(wrong.contains(&format!("column_collapse.toml:{}:1: time.edn", line + 1)), "{wrong}");
    let wrong = text(&job, &[&materials, "[time]\nend = 2\n"].concat()).unwrap_err();
    assert!(wrong.contains("materials.toml:") && wrong.contains("a second time"), "{wrong}");
    // Faults that only the first state shows name the included file as well.
    let start = JOB.find("[[bodies]]").unwrap();
    let end = start + JOB[start..].find("[time]").unwrap();
    write("bodies.toml", &format!("# A column.\n{}", &JOB[start..end]));
    let cut = [&JOB[..start], &JOB[end..]].concat();
    write("column_collapse.toml", &cut.replace("version = 1", "version = 1\ninclude = [\"bodies.toml\"]"));
    let AnyProblem::Three(problem) = load(&path).unwrap() else { panic!("3D") };
    let place = &problem.bodies[0].place;
    assert!(place.file.ends_with("bodies.toml") && place.line > 2 && place.line < 12, "{place}");
    // Settings also change included tables.
    let mut settings = Settings::default();
    settings.set("materials.0.density=-1").unwrap();
    text(&job, &materials).unwrap();
    let wrong = load_with(&path, &settings).map(|problem| problem.digest()).unwrap_err().to_string();
    assert!(wrong.contains("--set materials.0.density=-1: materials[0].density"), "{wrong}");
}
