//! `orthowear check`.

use super::{SceneArgs, exit, refuse, to_stdout, use_threads};
use crate::scene;

/// Checks a scene and prints what a run would do.
pub(super) fn check(arguments: &SceneArgs) -> u8 {
    use_threads(arguments.threads);
    match scene::read(&arguments.scene, &arguments.overrides) {
        Ok(plan) => {
            to_stdout(&format!("{}: no mistakes found\n", plan.document.file));
            exit::DONE
        }
        Err(mistakes) => refuse(&mistakes),
    }
}
