//! Command line, with one module per subcommand. docs/command-line.md defines the exit codes.

mod accuracy;
mod allocator;
mod check;
mod compare;
mod console;
mod max_memory;
mod options;
mod progress;
mod refine;
mod render;
mod report;
mod resume;
mod run;
mod run_numbers;
mod schema;
mod signal;
mod slurm;
mod study;
mod table;

use std::error::Error as _;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use clap::{Parser, Subcommand};

use crate::error::Error;
pub use crate::error::exit;
use crate::simulation::job::start_pool_thread;
pub use allocator::Allocator;
use console::{OUTPUT_LOST, is_lost, print_error, to_stderr};
pub use max_memory::{MaxMemory, parse_max_memory};
use options::{CommandResult, CompareArgs, RunArgs, SceneArgs, StudyArgs};
pub use render::render;

/// Frictional contact and wear of orthotropic bodies: finite elements, boundary elements and half-spaces on a contact frame.
#[derive(Debug, Parser)]
#[command(name = "orthowear", version, arg_required_else_help = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs a scene and writes its results.
    Run(RunArgs),
    /// Runs a scene in several variants (finite elements, boundary elements, half-spaces) and reports the differences.
    Compare(CompareArgs),
    /// Runs a parameter study: all combinations of given values, with a table of the results.
    Study(StudyArgs),
    /// Validates a scene and its meshes; prints the work that a run computes and skips, and its expected time and memory.
    Check(SceneArgs),
    /// Estimates the discretisation error of the meshes from the first steps and writes gmsh size fields for better meshes.
    Refine(refine::RefineArgs),
    /// Writes an HTML report of the results of a run, a comparison or a study.
    Report(report::ReportArgs),
    /// Prints the JSON Schema of a scene, or of a study.
    Schema {
        /// Prints the schema of study files instead.
        #[arg(long)]
        study: bool,
    },
}

/// Runs the program with its arguments; the first argument is the name of the program. Returns the exit code.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let command = match CommandLine::try_parse_from(arguments) {
        Ok(line) => line.command,
        Err(error) => {
            // Help and version are no errors. A closed pipe is no failure.
            let printed = error.print().and_then(|()| std::io::stdout().flush());
            let code = u8::try_from(error.exit_code()).unwrap_or(exit::INPUT);
            let lost = code == exit::DONE && is_lost(&printed);
            return ExitCode::from(if lost { exit::RESOURCES } else { code });
        }
    };
    report_large_files_as_errors();
    std::panic::set_hook(Box::new(report_panic));
    let code = std::panic::catch_unwind(|| match command {
        Command::Run(arguments) => run_interruptible(arguments.scene.threads, || run::run(&arguments)),
        Command::Compare(arguments) => {
            run_interruptible(arguments.scene.threads, || compare::compare(&arguments))
        }
        Command::Study(arguments) => run_interruptible(arguments.threads, || study::study(&arguments)),
        Command::Check(arguments) => run_in_thread_pool(arguments.threads, || check::check(&arguments)),
        Command::Refine(arguments) => {
            run_interruptible(arguments.scene.threads, || refine::refine(&arguments))
        }
        Command::Report(arguments) => report::report(&arguments),
        Command::Schema { study } => schema::schema(study),
    });
    let code = match code {
        Ok(Ok(code) | Err(code)) => code,
        Err(_) => exit::FAILED,
    };
    let lost = if OUTPUT_LOST.load(Ordering::Relaxed) { exit::RESOURCES } else { exit::DONE };
    ExitCode::from(exit::worse(code, lost))
}

/// Makes a write beyond the file size limit (`ulimit -f`) return an error. By default, the signal SIGXFSZ would end the
/// program.
fn report_large_files_as_errors() {
    #[cfg(unix)]
    // SAFETY: the signal is ignored, so it runs no code of this program.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

fn report_panic(info: &std::panic::PanicHookInfo<'_>) {
    let what = info.payload_as_str().unwrap_or("no message");
    let place = info.location().map(|l| format!(" ({}:{})", l.file(), l.line())).unwrap_or_default();
    to_stderr(&format!(
        "internal error, please report it with the scene: {what}{place}\n\
         orthowear {} on {}\n",
        env!("CARGO_PKG_VERSION"),
        std::env::consts::OS
    ));
}

/// Installs the signal handling before any threads start, then runs `work`.
fn run_interruptible(threads: Option<u16>, work: impl FnOnce() -> CommandResult + Send) -> CommandResult {
    signal::install();
    run_in_thread_pool(threads, work)
}

/// Runs `work` on a thread of the global pool. Outside the pool, each parallel operation would first wait for a thread
/// of the pool.
fn run_in_thread_pool(threads: Option<u16>, work: impl FnOnce() -> CommandResult + Send) -> CommandResult {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .spawn_handler(start_pool_thread)
        .build_global();
    // An error without a source means that the pool already exists.
    if let Err(error) = pool
        && let Some(cause) = error.source()
    {
        let message = format!(
            "the threads cannot be started: {cause}. Raise the limits of the shell (ulimit), or use fewer threads (--threads) if there are more than one"
        );
        return Err(print_error(&Error::resources(message)));
    }
    rayon::scope(|_| work())
}
