//! Fuzzes the reader of OBJ meshes.
#![no_main]

use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| gradfarm_fuzz::mesh("obj", bytes));
