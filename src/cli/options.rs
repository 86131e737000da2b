//! Options of the subcommands.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::console::print_error;
use super::max_memory::{MaxMemory, parse_max_memory};
use super::run_numbers::RunNumbers;
use crate::fem::FlexibilityCache;
use crate::scene::variant::DiscretisationPair;
use crate::scene::{self, Diagnostics, Plan};

/// Scene file with its overrides, number of threads and memory limit.
#[derive(Debug, Args)]
pub(super) struct SceneArgs {
    /// Scene file (TOML).
    pub(super) scene: PathBuf,
    /// Replaces or adds a value of the scene, e.g. --set gap.radius=25.0 or --set steps.indent.approach=0.01; may be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub(super) overrides: Vec<String>,
    /// Number of threads; default: all cores. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Memory limit: bytes, a size like "4 GiB", or a share of the available memory like "50 %". Overrides `solver.memory_limit`;
    /// default 80 %.
    #[arg(long, value_name = "SIZE", value_parser = parse_max_memory, allow_hyphen_values = true)]
    pub(super) max_memory: Option<MaxMemory>,
}

impl SceneArgs {
    /// Plan of the scene with the overrides of the command line.
    pub(super) fn plan(&self) -> Result<Plan, Diagnostics> {
        self.plan_with_accuracy(None)
    }

    /// As [`Self::plan`], with the relative error of the option `--accuracy`. It is added as an override if `--set`
    /// overrides other keys of the table `accuracy`, such as `accuracy.of=["load"]`.
    pub(super) fn plan_with_accuracy(&self, accuracy: Option<f64>) -> Result<Plan, Diagnostics> {
        let mut overrides = self.overrides.clone();
        if let Some(relative) = accuracy
            && overrides.iter().any(|line| line.trim_start().starts_with("accuracy."))
            && !overrides.iter().any(|line| line.trim_start().starts_with("accuracy.relative"))
        {
            overrides.push(format!("accuracy.relative={relative:e}"));
        }
        let mut plan = scene::read(&self.scene, &overrides)?;
        plan.override_memory_limit(self.max_memory.map(MaxMemory::limit));
        Ok(plan)
    }
}

#[derive(Debug, Args)]
pub(super) struct RunArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Output directory; default: path of the scene with the extension .out.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Does not read or write the cache of flexibility matrices of meshed bodies.
    #[arg(long)]
    pub(super) no_cache: bool,
    /// Target relative error, e.g. 1e-3: cells, increments and wear jumps are refined until the estimated error is below it.
    /// Overrides `accuracy` of the scene.
    #[arg(long, value_name = "ERROR", value_parser = parse_relative_error)]
    pub(super) accuracy: Option<f64>,
    /// Resumes from the last checkpoint in the output directory; without a checkpoint the run starts from the beginning.
    #[arg(long)]
    pub(super) resume: bool,
    /// Prints errors only.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// Exit code of a command. `Err` if an interruption or an error ended the command early; the error has been printed.
pub(super) type CommandResult = Result<u8, u8>;

/// The user's cache of flexibility matrices. `None` if `excluded` is true or the environment disables the cache.
///
/// # Errors
/// Prints the error and returns its exit code.
pub(super) fn flexibility_cache(excluded: bool) -> Result<Option<FlexibilityCache>, u8> {
    if excluded {
        return Ok(None);
    }
    FlexibilityCache::of_environment().map_err(|error| print_error(&error))
}

pub(super) fn parse_relative_error(text: &str) -> Result<f64, String> {
    let number = text.trim().parse::<f64>().ok().filter(|number| *number > 0.0 && *number <= 0.1);
    number.ok_or_else(|| "it must be a number above 0 and at most 0.1, like 1e-3".to_owned())
}

#[derive(Debug, Args)]
pub(super) struct CompareArgs {
    #[command(flatten)]
    pub(super) scene: SceneArgs,
    /// Models of body 1 and body 2 in each variant, e.g. FE-FE,FE-BE; the first variant is the reference. FE: finite elements, BE:
    /// boundary elements, HS: half-space, THS: truncated half-space, rigid. Overrides `compare.variants` of the scene.
    #[arg(long, value_name = "PAIRS", value_delimiter = ',')]
    pub(super) variants: Vec<DiscretisationPair>,
    /// Output directory; default: path of the scene with the extension .compare.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Does not read or write the cache of flexibility matrices of meshed bodies.
    #[arg(long)]
    pub(super) no_cache: bool,
    /// Prints errors only.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// Options of `orthowear study`.
#[derive(Debug, Args)]
pub(super) struct StudyArgs {
    /// Study file (TOML): a scene and the values to vary.
    pub(super) study: PathBuf,
    /// Output directory; default: path of the study file with the extension .study.
    #[arg(long, value_name = "DIR")]
    pub(super) out: Option<PathBuf>,
    /// Replaces or adds a value of the scene in all runs, e.g. --set gap.radius=25.0; may be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    pub(super) overrides: Vec<String>,
    /// Number of threads of all runs together; default: all cores. Results do not depend on it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Memory limit of all runs together: bytes, a size like "4 GiB", or a share of the available memory like "50 %". Overrides
    /// `solver.memory_limit`; default 80 %.
    #[arg(long, value_name = "SIZE", value_parser = parse_max_memory, allow_hyphen_values = true)]
    pub(super) max_memory: Option<MaxMemory>,
    /// Does not read or write the cache of flexibility matrices of meshed bodies.
    #[arg(long)]
    pub(super) no_cache: bool,
    /// Keeps converged runs and resumes unfinished runs from their last checkpoints.
    #[arg(long)]
    pub(super) resume: bool,
    /// Runs only the runs with these numbers, e.g. 3 or 1-4,9 (counted from 1 in the order of the table). Writes no table; see
    /// --collect.
    #[arg(long, value_name = "NUMBERS", conflicts_with_all = ["collect", "emit"])]
    pub(super) only: Option<RunNumbers>,
    /// Runs nothing; writes the table from the results of the runs so far.
    #[arg(long, conflicts_with_all = ["resume", "emit", "jobs"])]
    pub(super) collect: bool,
    /// Runs nothing; prints a script that runs the study on a cluster as a job array.
    #[arg(long, value_name = "KIND", conflicts_with = "resume")]
    pub(super) emit: Option<ScriptKind>,
    /// Number of jobs in the array; default: one per run, at most 1000.
    #[arg(long, value_name = "N", requires = "emit", value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) jobs: Option<u32>,
    /// Prints errors only.
    #[arg(long)]
    pub(super) quiet: bool,
}

/// Kinds of scripts.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub(super) enum ScriptKind {
    /// Job array of Slurm, for sbatch.
    Slurm,
}
