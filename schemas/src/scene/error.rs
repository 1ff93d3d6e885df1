//! What can be wrong with a scene.

/// A scene that cannot be used; the message names the key, the value and what was expected.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Not TOML, or not the shape of a scene. The text holds line, column and, for an unknown key, a suggestion.
    #[error("{0}")]
    Syntax(String),
    /// A value that has the right type and is out of its range.
    #[error("{key} = {value}: expected {expected}")]
    Value {
        /// The key's path, as in `ring[3].mass_kg`.
        key: String,
        /// The value as given.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// A name that nothing in the scene has.
    #[error("{key} = \"{value}\": no such {what} in this scene{suggestion}")]
    UnknownName {
        /// The key's path.
        key: String,
        /// The name as given.
        value: String,
        /// What kind of thing was named.
        what: &'static str,
        /// `; did you mean "..."?`, or nothing.
        suggestion: String,
    },
    /// An override that is not `key.path=value`.
    #[error("--set {text}: expected key.path=value, for example --set time.duration_s=1.5")]
    Override {
        /// The override as given.
        text: String,
    },
    /// An override with an integer that TOML cannot hold.
    #[error("--set {text}: TOML integers go from -9223372036854775808 to 9223372036854775807{hint}")]
    OverrideInteger {
        /// The override as given.
        text: String,
        /// What takes larger ones, or nothing.
        hint: &'static str,
    },
    /// An override whose path leads through something that is not a table or a list entry.
    #[error("--set {text}: there is no '{part}' to go into")]
    OverridePath {
        /// The override as given.
        text: String,
        /// The part of the path that could not be followed.
        part: String,
    },
}
