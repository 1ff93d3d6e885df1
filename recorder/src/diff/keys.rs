//! Differences of two JSON values, by key path.

use schemas::plan::{Plan, PlanEntry};
use schemas::step::StepRecord;
use serde::Serialize;
use serde_json::Value;

/// A key whose value differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KeyDifference {
    /// The path, as in `ring.3.mass_kg`: list entries are numbered from 0.
    pub key: String,
    /// The value in the first log; `None` if it has no such key.
    pub a: Option<Value>,
    /// The value in the second log.
    pub b: Option<Value>,
}

/// All keys that differ, in the order of the first value's keys, then those that only the second has.
pub fn compare(a: &Value, b: &Value) -> Vec<KeyDifference> {
    let mut differences = Vec::new();
    descend(String::new(), Some(a), Some(b), &mut differences);
    differences
}

fn descend(key: String, a: Option<&Value>, b: Option<&Value>, differences: &mut Vec<KeyDifference>) {
    let path = |part: &str| if key.is_empty() { part.to_owned() } else { format!("{key}.{part}") };
    match (a, b) {
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            for (name, value) in a {
                descend(path(name), Some(value), b.get(name), differences);
            }
            for (name, value) in b.iter().filter(|(name, _)| !a.contains_key(*name)) {
                descend(path(name), None, Some(value), differences);
            }
        }
        (Some(Value::Array(a)), Some(Value::Array(b))) => {
            for index in 0..a.len().max(b.len()) {
                descend(path(&index.to_string()), a.get(index), b.get(index), differences);
            }
        }
        (a, b) if a != b => differences.push(KeyDifference { key, a: a.cloned(), b: b.cloned() }),
        _ => {}
    }
}

/// Fields of two step records that differ.
pub fn compare_records(a: &StepRecord, b: &StepRecord) -> Vec<KeyDifference> {
    // A record holds numbers, texts and lists of them: each has a JSON value.
    let [a, b] = [a, b].map(|record| serde_json::to_value(record).unwrap_or_default());
    compare(&a, &b)
}

/// Lines of two plans that differ, by the part that they are about: `plan.force/drag`.
pub fn compare_plans(a: &Plan, b: &Plan) -> Vec<KeyDifference> {
    let line = |plan: &Plan, part: &str| plan.entries.iter().find(|entry| entry.part == part).map(text_of);
    let only_b = b.entries.iter().filter(|entry| a.entries.iter().all(|other| other.part != entry.part));
    let mut differences = Vec::new();
    for entry in a.entries.iter().chain(only_b) {
        let (a, b) = (line(a, &entry.part), line(b, &entry.part));
        if a != b {
            let key = format!("plan.{}", entry.part);
            differences.push(KeyDifference { key, a: a.map(Value::String), b: b.map(Value::String) });
        }
    }
    differences
}

fn text_of(entry: &PlanEntry) -> String {
    format!("{}: {}", if entry.needed { "needed" } else { "left out" }, entry.reason)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn plans_are_compared_by_part() {
        let (mut a, mut b) = (Plan::default(), Plan::default());
        a.push("force/gravity", true, "9.81 m/s^2");
        a.push("force/drag", false, "no coefficient");
        a.push("only/a", true, "");
        b.push("only/b", false, "x");
        b.push("force/drag", true, "0.1 kg/s");
        b.push("force/gravity", true, "9.81 m/s^2");
        let found: Vec<_> =
            compare_plans(&a, &b).into_iter().map(|found| (found.key, found.a, found.b)).collect();
        let expected = [
            ("plan.force/drag", Some(json!("left out: no coefficient")), Some(json!("needed: 0.1 kg/s"))),
            ("plan.only/a", Some(json!("needed: ")), None),
            ("plan.only/b", None, Some(json!("left out: x"))),
        ];
        assert_eq!(found, expected.map(|(key, a, b)| (key.to_owned(), a, b)));
        assert!(compare_plans(&a, &a).is_empty());
    }

    #[test]
    fn paths_and_values() {
        let a = json!({"x": 1.0, "list": [1, {"y": "a"}], "only_a": true});
        let b = json!({"x": 1.0, "list": [1, {"y": "b"}, 3], "only_b": null});
        let found: Vec<_> = compare(&a, &b).into_iter().map(|found| (found.key, found.a, found.b)).collect();
        let expected = [
            ("list.1.y", Some(json!("a")), Some(json!("b"))),
            ("list.2", None, Some(json!(3))),
            ("only_a", Some(json!(true)), None),
            ("only_b", None, Some(json!(null))),
        ];
        assert_eq!(found, expected.map(|(key, a, b)| (key.to_owned(), a, b)));
        assert!(compare(&a, &a).is_empty());
    }
}
