//! Is the repository what its ARCHITECTURE.md says? Arrows, banned words, file sizes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Which workspace crates a crate may name. ARCHITECTURE.md holds the same table in words.
fn allowed_arrows() -> BTreeMap<&'static str, &'static [&'static str]> {
    BTreeMap::from([
        ("schemas", &[][..]),
        ("geometry", &[][..]),
        ("random", &[][..]),
        ("bus", &["schemas"][..]),
        ("sim-node", &["schemas", "geometry", "random", "bus"][..]),
        ("render-node", &["schemas", "geometry", "random", "bus"][..]),
        ("recorder", &["schemas", "bus"][..]),
        ("studies", &["schemas", "sim-node"][..]),
        ("", &["schemas", "bus", "sim-node", "render-node", "recorder", "studies"][..]),
    ])
}

fn manifest(folder: &str) -> toml::Table {
    let path = root().join(folder).join("Cargo.toml");
    let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn dependencies(manifest: &toml::Table, section: &str) -> Vec<String> {
    manifest
        .get(section)
        .and_then(toml::Value::as_table)
        .into_iter()
        .flat_map(toml::Table::keys)
        .cloned()
        .collect()
}

/// Every source file of a folder, in a fixed order.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    files
}

fn lines_of_code(path: &Path) -> Vec<(usize, String)> {
    let text = fs::read_to_string(path).expect("a source file is text");
    let code = text.lines().enumerate().map(|(index, line)| (index + 1, line.trim().to_owned()));
    code.filter(|(_, line)| !line.starts_with("//")).collect()
}

#[test]
fn dependency_arrows_run_one_way() {
    let arrows = allowed_arrows();
    let members: Vec<_> = arrows.keys().filter(|name| !name.is_empty()).copied().collect();
    let listed = manifest("")["workspace"]["members"].as_array().expect("a list of members").clone();
    for member in &listed {
        let name = member.as_str().expect("a folder");
        assert!(arrows.contains_key(name), "{name} is in the workspace and not in the table of arrows");
    }
    for (folder, allowed) in &arrows {
        for name in dependencies(&manifest(folder), "dependencies") {
            let is_member = members.contains(&name.as_str());
            assert!(!is_member || allowed.contains(&name.as_str()), "'{folder}' must not know '{name}'");
        }
    }
}

#[test]
fn one_home_for_each_outside_library() {
    for (library, home) in
        [("iceoryx2", "bus"), ("bincode", "schemas"), ("mcap", "recorder"), ("rand_chacha", "random")]
    {
        for folder in allowed_arrows().keys() {
            let named = dependencies(&manifest(folder), "dependencies").iter().any(|name| name == library);
            assert_eq!(named, *folder == home, "{library} belongs to {home}; '{folder}' is another matter");
        }
    }
}

#[test]
fn inside_a_node_only_node_rs_names_the_bus() {
    for node in ["sim-node", "render-node", "recorder"] {
        for path in sources(&root().join(node).join("src")) {
            let inside_node = path.file_name().is_some_and(|name| name == "node.rs")
                || path.parent().is_some_and(|folder| folder.ends_with("node"));
            for (number, line) in lines_of_code(&path) {
                let names_bus = line.contains("bus::") || line.contains("use bus");
                assert!(inside_node || !names_bus, "{}:{number} names the bus: {line}", path.display());
            }
        }
    }
}

#[test]
fn the_core_knows_no_clock_and_no_files() {
    let banned = ["std::time", "Instant::now", "SystemTime", "std::fs", "thread_rng", "std::env"];
    for folder in ["geometry", "random", "schemas", "sim-node", "render-node"] {
        for path in sources(&root().join(folder).join("src")) {
            let at_the_edge = path
                .components()
                .any(|part| ["node.rs", "node", "main.rs"].iter().any(|name| part.as_os_str() == *name));
            for (number, line) in lines_of_code(&path) {
                let found = banned.iter().find(|word| line.contains(**word));
                assert!(at_the_edge || found.is_none(), "{}:{number} knows {found:?}", path.display());
            }
        }
    }
}

#[test]
fn every_crate_is_under_the_lints() {
    for folder in allowed_arrows().keys() {
        let manifest = manifest(folder);
        assert_eq!(
            manifest["lints"]["workspace"].as_bool(),
            Some(true),
            "'{folder}' is not under the workspace's lints"
        );
    }
    let lints = &manifest("")["workspace"]["lints"];
    assert_eq!(lints["clippy"]["disallowed_methods"].as_str(), Some("deny"));
    let clippy: toml::Table =
        fs::read_to_string(root().join("clippy.toml")).expect("clippy.toml").parse().expect("TOML");
    let banned = clippy["disallowed-methods"].as_array().expect("a list");
    for path in ["f64::sin", "f64::powf", "f64::cbrt", "f64::hypot", "f64::min", "f64::clamp", "f64::mul_add"]
    {
        assert!(banned.iter().any(|entry| entry["path"].as_str() == Some(path)), "{path} is not banned");
    }
}

#[test]
fn nothing_is_switched_off_or_left_unfinished() {
    // Written in two halves, so that this file does not find itself.
    let words =
        [["todo", "!("], ["unimplemented", "!("], ["#[ig", "nore"], ["thread::", "sleep("], ["dbg", "!("]]
            .map(|halves| halves.concat());
    for path in sources(root()) {
        // The bus has to give way to other processes where iceoryx2 offers nothing to wait on, and its test peer
        // is slow on purpose. The test that kills at any moment has to come to that moment. A file lock that another
        // process holds comes with no event either.
        let sleeps = path.starts_with(root().join("bus"))
            || ["killed_anywhere.rs", "recorder/src/target.rs"].iter().any(|file| path.ends_with(file));
        for (number, line) in lines_of_code(&path) {
            for word in words.iter().filter(|word| !(sleeps && word.starts_with("thread::"))) {
                assert!(!line.contains(word.as_str()), "{}:{number}: {line}", path.display());
            }
        }
    }
}

#[test]
fn files_have_one_subject() {
    for path in sources(root()) {
        let lines = fs::read_to_string(&path).expect("text").lines().count();
        assert!(lines <= 500, "{} has {lines} lines: does it still have one subject?", path.display());
    }
}

#[test]
fn architecture_fits_two_pages() {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md");
    let words = text.split_whitespace().count();
    assert!(words <= 1300, "ARCHITECTURE.md has {words} words; two pages hold about 1,300");
    for folder in allowed_arrows().keys().filter(|name| !name.is_empty()) {
        assert!(text.contains(&format!("`{folder}/`")), "ARCHITECTURE.md does not say what {folder}/ is");
    }
}

#[test]
fn no_path_of_somebodys_machine() {
    let homes =
        [["/ho", "me/"], ["/ro", "ot/"], ["/wo", "rk/"], ["/Us", "ers/"]].map(|halves| halves.concat());
    for path in sources(root()) {
        for (number, line) in lines_of_code(&path) {
            assert!(
                !homes.iter().any(|home| line.contains(home.as_str())),
                "{}:{number}: {line}",
                path.display()
            );
        }
    }
}
