//! Entry point of the program.

#[global_allocator]
static ALLOCATOR: orthowear::cli::Allocator = orthowear::cli::Allocator;

fn main() -> std::process::ExitCode {
    orthowear::cli::main(std::env::args_os())
}
