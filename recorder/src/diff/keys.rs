//! Differences of two JSON values, by key path.

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

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

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
