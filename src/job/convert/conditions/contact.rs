//! Contact between bodies: which bodies share a velocity field, and the law between these.
use std::collections::BTreeMap;

use crate::boundary::BodyContacts;
use crate::boundary::bodies::{Pair, PairLaw};
use crate::job::convert::checks::Checks;
use crate::job::parse::source::Path;
use crate::job::schema::conditions::contact::{BodyContact, PairKind, Side};
use crate::job::schema::job_file::JobFile;

/// Most velocity fields of a job.
const MAX_FIELDS: usize = 250;

/// Contact of two bodies: the law, the number of the contact, and whether the first body is on a later side
/// of it.
type Law = (PairLaw, u16, bool);

/// All contacts between bodies, or faults.
pub(in crate::job::convert) fn body_contacts(
    checks: &mut Checks,
    file: &JobFile,
    path: &Path,
) -> Option<BodyContacts> {
    let bodies = file.body_names();
    let mut laws: BTreeMap<[u16; 2], Law> = BTreeMap::new();
    let (mut names, mut sound) = (Vec::<(String, bool)>::new(), true);
    for (number, written) in file.contact.iter().enumerate() {
        let here = path.index(number);
        let name = written.name.clone().unwrap_or_else(|| (number + 1).to_string());
        checks.column_name(&name, names.iter().map(|(name, _)| &**name), &here.key("name"));
        let law = law(checks, written, &here);
        let Some((sides, law)) = sides(checks, written, &bodies, &here).zip(law) else {
            sound = false;
            continue;
        };
        names.push((name, sides.len() == 2));
        for (i, first) in sides.iter().enumerate() {
            for second in &sides[i + 1..] {
                for (&a, &b) in first.iter().flat_map(|a| second.iter().map(move |b| (a, b))) {
                    match law {
                        PairLaw::Sticky => laws.remove(&[a.min(b), a.max(b)]),
                        law => laws.insert([a.min(b), a.max(b)], (law, number as u16, a > b)),
                    };
                }
            }
        }
    }
    let contacts = fields(&laws, bodies.len(), names);
    if contacts.is_none() {
        let message = format!(
            "found contacts that need more than {MAX_FIELDS} velocity fields; expected fewer bodies in contact with each other, or lists of bodies that belong to one side"
        );
        checks.fault(path, message);
    }
    contacts.filter(|_| sound)
}

/// Bodies with the same laws towards all others share a field.
fn fields(laws: &BTreeMap<[u16; 2], Law>, bodies: usize, names: Vec<(String, bool)>) -> Option<BodyContacts> {
    let mut meets: Vec<Vec<(u16, Law)>> = vec![Vec::new(); bodies];
    for (&[a, b], &law) in laws {
        let (kind, contact, turned) = law;
        meets[usize::from(a)].push((b, law));
        meets[usize::from(b)].push((a, (kind, contact, !turned)));
    }
    let mut first_of_field: Vec<usize> = Vec::new();
    let mut field_of_body = Vec::with_capacity(bodies);
    for body in 0..bodies {
        let known = first_of_field.iter().position(|&first| meets[first] == meets[body]);
        if known.is_none() {
            first_of_field.push(body);
        }
        field_of_body.push(known.unwrap_or(first_of_field.len() - 1));
    }
    if first_of_field.len() > MAX_FIELDS {
        return None;
    }
    // All bodies of two fields have the same law.
    let mut pairs = BTreeMap::new();
    for (&[a, b], &(law, contact, turned)) in laws {
        let (f, g) = (field_of_body[usize::from(a)], field_of_body[usize::from(b)]);
        let fields = [f.min(g) as u8, f.max(g) as u8];
        pairs.entry(fields).or_insert(Pair { fields, law, contact, turned: turned != (f > g) });
    }
    let several = first_of_field.len() > 1;
    let field_of_body =
        if several { field_of_body.into_iter().map(|field| field as u8).collect() } else { Vec::new() };
    Some(BodyContacts { field_of_body, pairs: pairs.into_values().collect(), names })
}

/// Numbers of the bodies of each side.
fn sides(checks: &mut Checks, written: &BodyContact, bodies: &[&str], path: &Path) -> Option<Vec<Vec<u16>>> {
    let Some(between) = &written.between else {
        if bodies.len() < 2 {
            checks.fault(path, "found a contact in a job with one body; expected at least two bodies".into());
            return None;
        }
        return Some((0..bodies.len() as u16).map(|body| vec![body]).collect());
    };
    let path = path.key("between");
    let mut sides: Vec<Vec<u16>> = Vec::new();
    for (i, side) in between.iter().enumerate() {
        let here = path.index(i);
        let side = match side {
            Side::One(name) => {
                let number = checks.named(name, "body", || bodies.iter().copied(), &here)?;
                vec![number as u16]
            }
            Side::Several(names) => checks.bodies(Some(names), bodies, &here)??,
        };
        if let Some(&taken) = side.iter().find(|body| sides.iter().flatten().any(|other| other == *body)) {
            let name = bodies[usize::from(taken)];
            checks.fault(
                &here,
                format!("found \"{name}\" on two sides; expected each body once: a body is not in contact with itself"),
            );
            return None;
        }
        sides.push(side);
    }
    Some(sides)
}

fn law(checks: &mut Checks, written: &BodyContact, path: &Path) -> Option<PairLaw> {
    let given =
        [("friction", written.friction), ("cohesion", written.cohesion), ("tension", written.tension)];
    let (name, law) = match written.kind {
        PairKind::Separating => {
            let [friction, cohesion, tension] = given.map(|(_, value)| value.unwrap_or(0.0));
            return Some(PairLaw::Separating { friction, cohesion, tension });
        }
        PairKind::Sticky => ("sticky", PairLaw::Sticky),
        PairKind::Slip => ("slip", PairLaw::Slip),
    };
    let Some((key, _)) = given.iter().find(|(_, value)| value.is_some()) else { return Some(law) };
    let message =
        format!("found {key} with kind = \"{name}\"; expected `{key}` only with kind = \"separating\"");
    checks.fault(&path.key(*key), message);
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: PairLaw = PairLaw::Separating { friction: 0.1, cohesion: 0.0, tension: 0.0 };

    #[test]
    fn bodies_that_meet_all_others_alike_share_a_field() {
        // Body 3 against 0 and 1; body 2 has no contact.
        let laws = [([0, 3], (LAW, 0, false)), ([1, 3], (LAW, 0, false))].into();
        let contacts = fields(&laws, 4, Vec::new()).unwrap();
        assert_eq!(contacts.field_of_body, [0, 0, 1, 2]);
        assert_eq!(contacts.fields(), 3);
        let pair = Pair { fields: [0, 2], law: LAW, contact: 0, turned: false };
        assert_eq!(contacts.pairs, [pair]);
        assert_eq!(fields(&BTreeMap::new(), 4, Vec::new()).unwrap(), BodyContacts::default());
    }
}
