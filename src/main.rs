//! Entry point of the program.
#![warn(clippy::too_many_lines)]

#[global_allocator]
static ALLOCATOR: orthowear::cli::Allocator = orthowear::cli::Allocator;

fn main() -> std::process::ExitCode {
    orthowear::cli::main(std::env::args_os())
}
