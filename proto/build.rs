//! Compiles the protocol with a protobuf compiler written in Rust: no system `protoc` is needed.

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=farm");
    let files = protox::compile(["farm/v1/plan.proto", "farm/v1/scene.proto", "farm/v1/worker.proto", "farm/v1/enrolment.proto"], ["."])?;
    tonic_prost_build::configure().bytes(".").compile_fds(files)?;
    Ok(())
}
