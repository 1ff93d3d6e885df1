//! `bus`: how other programs of iceoryx2 find the topics of a run.

use crate::failure::Outcome;
use crate::terminal::print;
use bus::BusName;
use clap::Args;

#[derive(Args)]
#[command(after_help = "Example, with a run on bus `mine` in another terminal, and iceoryx2's own tool:\n  \
                        mkdir config\n  chainmail bus mine > config/iceoryx2.toml\n  iox2 service list\n  iox2 service hz \
                        step")]
pub struct Arguments {
    /// Name of the bus
    name: BusName,
}

/// Prints a configuration file of iceoryx2 for a bus.
pub fn run(arguments: &Arguments) -> Outcome {
    let name = &arguments.name;
    // Both are quoted as they are: no name or prefix has a quote in it, and a folder that has one is refused by iceoryx2.
    print(&format!(
        "# iceoryx2 0.10: the topics of bus {name}. A file config/iceoryx2.toml is found by `iox2` in the folder it runs in.\n\
         [global]\nroot-path = '{}'\nprefix = '{}'",
        name.root_dir().display(),
        name.shared_memory_prefix()
    ))
}
