//! Meshes that were read before, so that the scenes of a study share them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::SystemTime;

use crate::error::Result;
use crate::mesh::{Mesh, gmsh};

/// The meshes of files that have not changed since they were read.
#[derive(Debug, Default)]
pub struct MeshCache(Mutex<HashMap<FileState, Arc<Mesh>>>);

/// A file's path, its length in bytes and when it was last changed.
type FileState = (PathBuf, u64, SystemTime);

impl MeshCache {
    /// The mesh of a gmsh file; read only if the file is new or has changed.
    ///
    /// # Errors
    /// As [`gmsh::read`].
    pub fn read(&self, path: &Path) -> Result<Arc<Mesh>> {
        let state =
            std::fs::metadata(path).and_then(|file| Ok((path.to_owned(), file.len(), file.modified()?)));
        let Ok(state) = state else { return Ok(Arc::new(gmsh::read(path)?)) };
        let known = self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&state).cloned();
        if let Some(mesh) = known {
            return Ok(mesh);
        }
        let mesh = Arc::new(gmsh::read(path)?);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(state, mesh.clone());
        Ok(mesh)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_TETRAHEDRON: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n\
        $Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n";

    /// Truth: a file that stays as it is is read once; one that changes is read again.
    #[test]
    fn files_are_read_once_unless_they_change() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.msh");
        std::fs::write(&path, ONE_TETRAHEDRON).unwrap();
        let meshes = MeshCache::default();
        let first = meshes.read(&path).unwrap();
        assert!(Arc::ptr_eq(&first, &meshes.read(&path).unwrap()));
        std::fs::write(&path, ONE_TETRAHEDRON.replace("4 0 0 1\n", "4 0 0 1.5\n")).unwrap();
        assert_eq!(meshes.read(&path).unwrap().points[3], [0.0, 0.0, 1.5]);
    }
}
