# `just` lists the recipes. Each is one cargo command or a few, so they can be typed by hand as well.

default:
    @just --list

# Format every crate.
fmt:
    cargo fmt --all

# Lints of all targets; warnings are errors.
lint:
    cargo clippy --workspace --all-targets -- -D warnings

# Unit, property, statistical and whole-system tests.
test:
    cargo test --workspace

# Compare every scene that has a reference image by another renderer: minutes. Names of scenes, and --effort N for N times the samples.
truth *ARGS:
    cargo run --release -p gradfarm-tests --example truth -- {{ARGS}}

# Laws of every shift over millions of base paths (1 unless given): minutes.
laws *ARGS:
    cargo run --release -p gradfarm-tests --example laws -- {{ARGS}}

# What each shift is worth on scenes: variance of differences and of the L2 image, and cost.
shifts *FILES:
    cargo run --release -p gradfarm-tests --example shifts -- {{FILES}}

# How well errors told without a reference agree with true ones, on scenes: minutes.
errors *FILES:
    cargo run --release -p gradfarm-tests --example errors -- {{FILES}}

# Kill and pause coordinator and workers at random, a thousand times unless given: many minutes.
chaos TIMES="1000" SEED="1":
    GRADFARM_CHAOS={{TIMES}} GRADFARM_CHAOS_SEED={{SEED}} cargo test --workspace --test farm_chaos -- --nocapture

# Time rays, materials, shifts and reconstructions.
bench *ARGS:
    cargo bench -p gradfarm-core {{ARGS}}

# Read the documentation of every crate.
doc:
    cargo doc --workspace --no-deps --open

# A coordinator with two workers of its own, on loopback.
farm *ARGS:
    cargo run --release -- serve --workers 2 {{ARGS}}

# What a change must pass before it is merged.
verify:
    .ci/run
