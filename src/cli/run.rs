//! `orthowear run`.

use super::{RunArgs, exit, refuse, to_stderr, use_threads};
use crate::scene;

/// Computes a scene and writes its results.
pub(super) fn run(arguments: &RunArgs) -> u8 {
    if arguments.resume {
        to_stderr("--resume is not available in this version: run the scene from the start\n");
        return exit::INPUT;
    }
    use_threads(arguments.scene.threads);
    match scene::read(&arguments.scene.scene, &arguments.scene.overrides) {
        Ok(_) => exit::FAILED,
        Err(mistakes) => refuse(&mistakes),
    }
}
