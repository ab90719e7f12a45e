#![no_main]

use sereno_tests::fuzz;

#[global_allocator]
static ALLOCATOR: fuzz::Peak = fuzz::Peak;

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    fuzz::signal(data);
});
