//! From text to a resolved scene.

use super::{Scene, SceneError};
use serde::Deserialize;

impl Scene {
    /// Reads a scene file, applies overrides, lays out its weaves and checks every value.
    ///
    /// An override is `key.path=value`; list entries are numbered from 0 (`ring.0.pinned=true`). The value is
    /// read as TOML; what is not TOML is taken as a string.
    ///
    /// # Errors
    ///
    /// [`SceneError`] names line and column, or key, value and what was expected.
    pub fn parse(text: &str, overrides: &[String]) -> Result<Scene, SceneError> {
        Scene::parse_seeded(text, overrides, None)
    }

    /// The same with another seed than the scene's; it also decides which rings a weave leaves out.
    ///
    /// # Errors
    ///
    /// As [`Scene::parse`].
    pub fn parse_seeded(text: &str, overrides: &[String], seed: Option<u64>) -> Result<Scene, SceneError> {
        let mut scene: Scene = if overrides.is_empty() {
            toml::from_str(text).map_err(syntax)?
        } else {
            let mut table: toml::Table = text.parse().map_err(syntax)?;
            apply(&mut table, overrides)?;
            Scene::deserialize(table).map_err(syntax)?
        };
        scene.seed = seed.unwrap_or(scene.seed);
        scene.resolve()
    }

    /// The same scene with another second half: overrides of `render.*` and of nothing else.
    ///
    /// # Errors
    ///
    /// [`SceneError`] as for [`Scene::parse`], and for a key outside `render`.
    pub fn with_render(&self, overrides: &[String]) -> Result<Scene, SceneError> {
        let expected = "a key of render.*: the motion in a log is what it is; use `run` to change it";
        self.with_keys(overrides, &|key| key.starts_with("render."), expected)
    }

    /// The same scene with what a log may be replayed with: overrides of `render.*` and of which states are kept
    /// (`record.state_every`) and how often the log is flushed.
    ///
    /// # Errors
    ///
    /// [`SceneError`] as for [`Scene::parse`], and for any other key.
    pub fn with_view(&self, overrides: &[String]) -> Result<Scene, SceneError> {
        const RECORD: [&str; 2] = ["record.state_every", "record.flush_every_s"];
        let may = |key: &str| key.starts_with("render.") || RECORD.contains(&key);
        let expected = "a key of render.*, or record.state_every or record.flush_every_s: the motion in a log is what it \
                        is; use `run` to change it";
        self.with_keys(overrides, &may, expected)
    }

    fn with_keys(
        &self,
        overrides: &[String],
        may: &dyn Fn(&str) -> bool,
        expected: &str,
    ) -> Result<Scene, SceneError> {
        for text in overrides {
            let (key, value) = halves(text)?;
            if !may(key) {
                let (key, value, expected) = (key.to_owned(), value.to_owned(), expected.to_owned());
                return Err(SceneError::Value { key, value, expected });
            }
        }
        let value_of = |value: Result<toml::Value, toml::ser::Error>| {
            value.map_err(|error| SceneError::Syntax(error.to_string()))
        };
        let mut table = toml::Table::new();
        table.insert("render".to_owned(), value_of(toml::Value::try_from(&self.render))?);
        table.insert("record".to_owned(), value_of(toml::Value::try_from(&self.record))?);
        apply(&mut table, overrides)?;
        let mut half = |name: &str| table.remove(name).unwrap_or(toml::Value::Table(toml::Table::new()));
        let render = Deserialize::deserialize(half("render")).map_err(syntax)?;
        let record = Deserialize::deserialize(half("record")).map_err(syntax)?;
        Scene { render, record, ..self.clone() }.resolve()
    }

    fn resolve(mut self) -> Result<Scene, SceneError> {
        self.canonicalise_zeros();
        self.validate()?;
        let woven: Vec<_> = self
            .weaves
            .iter()
            .enumerate()
            .flat_map(|(number, weave)| weave.rings(self.seed, number))
            .collect();
        self.weaves.clear();
        // Woven rings come first, then explicit ones, each in the order of the file.
        self.rings.splice(0..0, woven);
        self.resolve_materials();
        self.normalise_directions();
        Ok(self)
    }
}

fn apply(table: &mut toml::Table, overrides: &[String]) -> Result<(), SceneError> {
    let mut root = toml::Value::Table(std::mem::take(table));
    for text in overrides {
        let malformed = || SceneError::Override { text: text.clone() };
        let missing = |part: &str| SceneError::OverridePath { text: text.clone(), part: part.to_owned() };
        let (path, value) = halves(text)?;
        if is_beyond_integers(value) {
            let hint = if path == "seed" { "; --seed takes more" } else { "" };
            return Err(SceneError::OverrideInteger { text: text.clone(), hint });
        }
        let mut parts: Vec<&str> = path.split('.').collect();
        let last = parts.pop().filter(|part| !part.is_empty()).ok_or_else(malformed)?;
        let mut place = &mut root;
        for part in parts {
            place = step_into(place, part).ok_or_else(|| missing(part))?;
        }
        let value = parse_value(value);
        match place {
            toml::Value::Table(inner) => {
                inner.insert(last.to_owned(), value);
            }
            toml::Value::Array(items) => {
                let slot = last.parse::<usize>().ok().and_then(|index| items.get_mut(index));
                *slot.ok_or_else(|| missing(last))? = value;
            }
            _ => return Err(missing(last)),
        }
    }
    if let toml::Value::Table(changed) = root {
        *table = changed;
    }
    Ok(())
}

/// The key's path and the value of an override.
fn halves(text: &str) -> Result<(&str, &str), SceneError> {
    let (path, value) = text.split_once('=').ok_or_else(|| SceneError::Override { text: text.to_owned() })?;
    Ok((path.trim(), value.trim()))
}

/// Whether a value is an integer that TOML, whose integers have 64 bits with the sign, has no room for.
fn is_beyond_integers(value: &str) -> bool {
    let digits = value.strip_prefix(['+', '-']).unwrap_or(value);
    let is_integer = !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
    is_integer && value.parse::<i64>().is_err()
}

fn step_into<'a>(place: &'a mut toml::Value, part: &str) -> Option<&'a mut toml::Value> {
    match place {
        toml::Value::Table(inner) => {
            Some(inner.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new())))
        }
        toml::Value::Array(items) => part.parse::<usize>().ok().and_then(|index| items.get_mut(index)),
        _ => None,
    }
}

fn parse_value(text: &str) -> toml::Value {
    format!("value = {text}")
        .parse::<toml::Table>()
        .ok()
        .and_then(|mut table| table.remove("value"))
        .unwrap_or_else(|| toml::Value::String(text.to_owned()))
}

/// The parser's message; an unknown key or choice gets a suggestion.
fn syntax(error: toml::de::Error) -> SceneError {
    let mut text = error.to_string();
    let message = error.message();
    let unknown =
        ["unknown field `", "unknown variant `"].iter().find_map(|start| message.strip_prefix(start));
    if let Some(rest) = unknown
        && let Some((unknown, rest)) = rest.split_once('`')
    {
        let known = rest.split('`').skip(1).step_by(2);
        // The message is the text's last part but for a line that tells the place.
        let end = text.rfind(message).map_or(text.len(), |start| start + message.len());
        text.insert_str(end, &suggestion(unknown, known));
    }
    SceneError::Syntax(text.trim_end().to_owned())
}

/// `; did you mean "..."?` for the known name nearest to an unknown one, or nothing.
pub(super) fn suggestion<'a>(unknown: &str, known: impl Iterator<Item = &'a str>) -> String {
    let distance = |name: &str| strsim::damerau_levenshtein(unknown, name);
    // A key without its unit is the most common slip, so a shared beginning counts as near.
    let near = |name: &&str| distance(name) <= 3.max(unknown.len() / 3) || name.starts_with(unknown);
    match known.filter(near).min_by_key(|name| (!name.starts_with(unknown), distance(name))) {
        Some(name) => format!("; did you mean \"{name}\"?"),
        None => String::new(),
    }
}
