//! Command line with one module per subcommand. docs/command-line.md defines the exit codes.

mod accuracy;
mod allocator;
mod check;
mod compare;
mod max_memory;
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
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};

use clap::{Args, Parser, Subcommand};

pub use crate::error::exit;
use crate::error::{Error, WARNING_PREFIX};
use crate::fem::FlexibilityCache;
use crate::scene::variant::DiscretisationPair;
use crate::scene::{self, Diagnostics, Plan};
use crate::simulation::job::THREAD_STACK_BYTES;
pub use allocator::Allocator;
pub use max_memory::{MaxMemory, parse_max_memory};
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
    Study(study::StudyArgs),
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

/// A scene and how to read it.
#[derive(Debug, Args)]
struct SceneArgs {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Replaces or adds a value of the scene, e.g. --set gap.radius=25.0 or --set steps.indent.approach=0.01; may be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    overrides: Vec<String>,
    /// Number of threads; default: all cores. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Memory limit: bytes, a size like "4 GiB", or a share of the available memory like "50 %". Overrides `solver.memory_limit`;
    /// default 80 %.
    #[arg(long, value_name = "SIZE", value_parser = parse_max_memory, allow_hyphen_values = true)]
    max_memory: Option<MaxMemory>,
}

impl SceneArgs {
    /// Plan of the scene with the overrides of the command line.
    fn plan(&self) -> Result<Plan, Diagnostics> {
        let mut plan = scene::read(&self.scene, &self.overrides)?;
        plan.override_memory_limit(self.max_memory.map(MaxMemory::limit));
        Ok(plan)
    }
}

#[derive(Debug, Args)]
struct RunArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Output directory; default: path of the scene with the extension .out.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Does not read or write the cache of flexibility matrices of meshed bodies.
    #[arg(long)]
    no_cache: bool,
    /// Target relative error, e.g. 1e-3: cells, increments and wear jumps are refined until the estimated error is below it.
    /// Overrides `accuracy` of the scene.
    #[arg(long, value_name = "ERROR", value_parser = parse_relative_error)]
    accuracy: Option<f64>,
    /// Resumes from the last checkpoint in the output directory; without a checkpoint the run starts from the beginning.
    #[arg(long)]
    resume: bool,
    /// Prints errors only.
    #[arg(long)]
    quiet: bool,
}

/// Exit code of a command. `Err` if it ended early, by an interruption or an error whose message was printed.
type CommandResult = Result<u8, u8>;

/// The user's cache of flexibility matrices; `None` if an option or the environment disables it.
///
/// # Errors
/// The exit code, after an error was printed.
fn flexibility_cache(excluded: bool) -> Result<Option<FlexibilityCache>, u8> {
    if excluded {
        return Ok(None);
    }
    FlexibilityCache::of_environment().map_err(|error| print_error(&error))
}

/// Parses a relative error.
fn parse_relative_error(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|number| *number > 0.0 && *number <= 0.1);
    number.ok_or_else(|| "it must be a number above 0 and at most 0.1, like 1e-3".to_owned())
}

#[derive(Debug, Args)]
struct CompareArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Models of body 1 and body 2 in each variant, e.g. FE-FE,FE-BE; the first variant is the reference. FE: finite elements, BE:
    /// boundary elements, HS: half-space, THS: truncated half-space, rigid. Overrides `compare.variants` of the scene.
    #[arg(long, value_name = "PAIRS", value_delimiter = ',')]
    variants: Vec<DiscretisationPair>,
    /// Output directory; default: path of the scene with the extension .compare.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Does not read or write the cache of flexibility matrices of meshed bodies.
    #[arg(long)]
    no_cache: bool,
    /// Prints errors only.
    #[arg(long)]
    quiet: bool,
}

/// Runs the program with its arguments, the first of which is its name. Returns the exit code.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> ExitCode {
    let command = match CommandLine::try_parse_from(arguments) {
        Ok(line) => line.command,
        Err(error) => {
            // Help and version are no errors, and a closed pipe is no failure.
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

/// Makes a write beyond the shell's file size limit (`ulimit -f`) an error of that file. Otherwise its signal ends the program.
fn report_large_files_as_errors() {
    #[cfg(unix)]
    // SAFETY: an ignored signal runs no code of this program.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}

/// Prints an internal error.
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

/// Runs `work` as [`run_in_thread_pool`], with signal handling installed before any threads start.
fn run_interruptible(threads: Option<u16>, work: impl FnOnce() -> CommandResult + Send) -> CommandResult {
    signal::install();
    run_in_thread_pool(threads, work)
}

/// Runs `work` on one of `threads` threads (default: the number of cores). Work submitted from outside the pool would wait for a
/// thread each time.
fn run_in_thread_pool(threads: Option<u16>, work: impl FnOnce() -> CommandResult + Send) -> CommandResult {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads.map_or(0, usize::from))
        .stack_size(THREAD_STACK_BYTES)
        .build_global();
    // An error without a cause means that the pool already exists, which is no failure.
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

/// Prints the diagnostics of a scene. Returns the exit code.
fn print_diagnostics(mistakes: &Diagnostics) -> u8 {
    to_stderr(&render::render(mistakes));
    exit::INPUT
}

/// Prints an error. Returns its exit code.
fn print_error(error: &Error) -> u8 {
    to_stderr(&format!("error: {error}\n"));
    error.exit_code()
}

/// Adds a severity to a message of a run. Warnings contain theirs.
fn with_severity(message: &str) -> String {
    if message.contains(WARNING_PREFIX) { message.to_owned() } else { format!("note: {message}") }
}

/// Whether a write to standard output failed, for example on a full disk.
static OUTPUT_LOST: AtomicBool = AtomicBool::new(false);

/// Prints to standard output. A failure is reported once and determines the exit code.
fn to_stdout(text: &str) {
    let mut out = std::io::stdout().lock();
    let printed = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    if !OUTPUT_LOST.load(Ordering::Relaxed) {
        OUTPUT_LOST.store(is_lost(&printed), Ordering::Relaxed);
    }
}

/// Whether a write to standard output failed, which is reported. A closed pipe is no failure.
fn is_lost(printed: &std::io::Result<()>) -> bool {
    let Err(error) = printed else { return false };
    let lost = error.kind() != std::io::ErrorKind::BrokenPipe;
    if lost {
        to_stderr(&format!("error: standard output cannot be written: {error}\n"));
    }
    lost
}

/// Prints to standard error. A closed pipe is no failure.
fn to_stderr(text: &str) {
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}
