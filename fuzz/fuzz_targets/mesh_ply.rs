//! Fuzzes the reader of PLY meshes.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| gradfarm_fuzz::mesh("ply", bytes));
