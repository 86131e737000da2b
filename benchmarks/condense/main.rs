//! Cost of the condensation of a finite-element block to its contact nodes, by stages, compared with CHOLMOD and MUMPS.

mod case;
mod compare;
#[path = "../im7.rs"]
mod im7;
#[path = "../machine.rs"]
mod machine;
mod measure;
#[path = "../../tests/fixtures/structured.rs"]
mod structured;

use std::error::Error;

use case::{Case, Ordering};
use measure::Route;

type Outcome<T> = Result<T, Box<dyn Error>>;

fn main() -> Outcome<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["measure", name, ordering, route, threads] => {
            rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build_global()?;
            let ordering = if ordering == "amd" { Ordering::Amd } else { Ordering::Metis };
            let route = if route == "solves" { Route::BackSolve } else { Route::Schur };
            measure::measure(name, ordering, route)
        }
        ["iterate", name, threads] => {
            rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build_global()?;
            measure::iterate(name)
        }
        ["compare", ref settings @ ..] => compare::compare(&compare::Settings::new(settings)?),
        ["write", name, path] => Case::new(name)?.write(path.as_ref()),
        _ => Err(format!(
            "allowed: measure NAME metis|amd schur|solves THREADS; iterate NAME THREADS; write NAME FILE; compare FOLDER OF PEERS [--repeats N] [--out DIR] [NAME..]; \
             names: {}",
            case::NAMES.join(", ")
        )
        .into()),
    }
}
