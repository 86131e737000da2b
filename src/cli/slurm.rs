//! Writes the script that runs a study as a Slurm job array.

use std::path::Path;

use super::max_memory::MaxMemory;
use super::options::StudyArgs;
use crate::sweep::Sweep;

/// Largest array index with Slurm's default setting (MaxArraySize = 1001).
const MAX_ARRAY_JOBS: usize = 1000;

const DEFAULT_THREADS_PER_JOB: u16 = 4;

/// Memory requested for a job, divided by the estimated memory of the runs that the job computes at the same time.
const MEMORY_MARGIN_FACTOR: f64 = 1.5;

const MIN_JOB_MEMORY_MIB: f64 = 1024.0;

fn shell_quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// Text of the script. The command `bash SCRIPT` submits the job array and the job that collects the results.
pub(super) fn script(arguments: &StudyArgs, sweep: &Sweep, directory: &Path) -> String {
    let runs = sweep.runs.len();
    let jobs = arguments.jobs.map_or(runs.min(MAX_ARRAY_JOBS), |jobs| runs.min(jobs as usize)).max(1);
    let each = runs.div_ceil(jobs);
    let jobs = runs.div_ceil(each);
    let threads = arguments.threads.unwrap_or(DEFAULT_THREADS_PER_JOB);
    let aside = each.min(usize::from(threads)) as f64;
    let memory = match arguments.max_memory {
        Some(MaxMemory::Bytes(limit)) => Some(limit as f64),
        _ => {
            let numbers: Vec<usize> = (0..runs).collect();
            sweep.largest_memory(&numbers).map(|largest| MEMORY_MARGIN_FACTOR * aside * largest)
        }
    };
    let memory = match memory {
        Some(bytes) => {
            format!("#SBATCH --mem={}M", (bytes / f64::from(1 << 20)).max(MIN_JOB_MEMORY_MIB).ceil())
        }
        None => "# Add --mem: the memory that a run needs could not be estimated.".to_owned(),
    };
    let study = shell_quoted(&arguments.study.to_string_lossy());
    let out = shell_quoted(&directory.to_string_lossy());
    let name = arguments.study.file_stem().map_or("study".into(), |stem| stem.to_string_lossy());
    let name: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-_.".contains(c) { c } else { '-' }).collect();
    let mut options: Vec<String> =
        arguments.overrides.iter().map(|line| format!("--set {}", shell_quoted(line))).collect();
    options.extend(
        arguments.max_memory.map(|limit| format!("--max-memory {}", shell_quoted(&limit.to_string()))),
    );
    options.extend(arguments.no_cache.then(|| "--no-cache".to_owned()));
    let options = options.iter().map(|option| format!(" {option}")).collect::<String>();
    format!(
        r#"#!/bin/bash
# {runs} runs of a study in an array of {jobs} jobs with {each} runs each at most, and a job that collects the table.
# Submit with `bash SCRIPT`: it submits the array and the collecting job. Jobs that reach their time limit resume when it is submitted again.
#SBATCH --job-name={name}
#SBATCH --cpus-per-task={threads}
{memory}
#SBATCH --signal=B:TERM@60
# Add here what your cluster requires for both jobs: --time, --partition, --account.

orthowear=${{ORTHOWEAR:-orthowear}}
study={study}
out={out}

if [ -n "$ORTHOWEAR_COLLECT" ]; then
    exec "$orthowear" study "$study" --out "$out" --collect{options}
elif [ -z "$SLURM_ARRAY_TASK_ID" ]; then
    array=$(sbatch --parsable --array=1-{jobs} "$0") || exit
    exec sbatch --dependency="afterany:${{array%%;*}}" --job-name={name}-table --export=ALL,ORTHOWEAR_COLLECT=1 "$0"
fi

first=$(((SLURM_ARRAY_TASK_ID - 1) * {each} + 1))
last=$((first + {each} - 1))
if [ "$last" -gt {runs} ]; then last={runs}; fi
trap 'kill -TERM "$run"' TERM
"$orthowear" study "$study" --out "$out" --only "$first-$last" --resume --quiet --threads "${{SLURM_CPUS_PER_TASK:-{threads}}}"{options} &
run=$!
wait "$run" # ends at a signal too
wait "$run"
"#
    )
}
