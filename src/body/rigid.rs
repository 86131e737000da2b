//! Bodies that do not deform.

use std::sync::Arc;

use super::{BodyEquations, BodyField, ElasticBody, Loading};
use crate::bem::half_space::CrossBlocks;
use crate::error::Result;
use crate::flexibility::Flexibility;

/// A rigid body, without flexibility.
#[derive(Debug, Clone, Copy, Default)]
pub struct RigidBody;

impl ElasticBody for RigidBody {
    fn describe(&self) -> String {
        "rigid".into()
    }

    fn equations(&self) -> BodyEquations<'_> {
        BodyEquations::Rigid
    }

    fn take_flexibility(&mut self, _cross: CrossBlocks) -> Result<Option<Arc<dyn Flexibility>>> {
        Ok(None)
    }

    fn recover(&self, loading: Loading) -> Result<BodyField> {
        Ok(BodyField { displacement: vec![[0.0; 3]; loading.tractions.len() / 3], stress: None })
    }
}
