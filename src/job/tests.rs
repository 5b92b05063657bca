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
    // Comments and the way numbers are written are not the state.
    assert_eq!(digest(JOB), digest(&JOB.replace("young = 3e5", "young = 300000 # Pa")));
}

#[test]
fn coordinates_are_relative_to_the_lower_corner() {
    let Ok(AnyProblem::Three(problem)) = parse(JOB, "job.toml".as_ref()) else { panic!("not a 3D job") };
    assert_eq!(problem.name, "job");
    assert_eq!(problem.origin, [-0.288, -0.288, 0.0]);
    assert_eq!(problem.brick.roots, [6, 6, 1]);
    assert!((problem.bodies[0].centre[0] - 0.288).abs() < 1e-15);
    let Some(problem::ReportSetup::ColumnCollapse { base, up, .. }) = problem.report else {
        panic!("no report")
    };
    assert_eq!((base, up), ([0.288, 0.288, 0.0], 2));
}

/// The schema names limits that the tree has.
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
