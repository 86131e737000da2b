//! The program: command line in, exit code out.

fn main() -> std::process::ExitCode {
    orthowear::cli::main(std::env::args_os())
}
