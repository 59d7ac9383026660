//! Task files embedded in the binary.

use super::{TaskOrigin, TaskSource};

/// Name of the suite whose tasks require one robot to inform the others.
pub const TANDEM_PLUS: &str = "tandem+";

/// A file name and its text.
pub(super) type Embedded = (&'static str, &'static str);

macro_rules! embedded {
    ($folder:literal: $($name:literal)*) => {
        &[$( (concat!($name, ".toml"), include_str!(concat!("../../tasks/", $folder, "/", $name, ".toml"))), )*]
    };
}

/// Task files of the benchmark, in the benchmark's order.
pub(super) const COHUB_FILES: &[Embedded] = embedded! { "cohub":
    "handover" "pouring" "frame_hang" "co_pouring" "trash_collection" "cart_service" "co_carry" "table_align" "move_house" "big_table"
};

/// Task files of the TANDEM+ suite, in listing order.
pub(super) const TANDEM_PLUS_FILES: &[Embedded] = embedded! { "tandem_plus":
    "which_one" "blind_carry" "relay" "set_the_table" "swap"
};

/// Returns the origin of a source. Only a verbatim copy of an embedded file counts as built in.
pub(super) fn origin_of(source: &TaskSource) -> TaskOrigin {
    let has_it = |files: &[Embedded]| {
        files
            .iter()
            .any(|(name, text)| *name == source.name && *text == source.text && source.beside.is_empty())
    };
    if has_it(COHUB_FILES) {
        TaskOrigin::Benchmark
    } else if has_it(TANDEM_PLUS_FILES) {
        TaskOrigin::Suite(TANDEM_PLUS)
    } else {
        TaskOrigin::File
    }
}
