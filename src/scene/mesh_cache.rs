//! Cache of meshes and their quality, shared by the scenes of a study.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

use crate::error::Result;
use crate::mesh::quality::{self, Quality};
use crate::mesh::{Mesh, gmsh};

/// Meshes of unchanged files. A mesh also has its quality if the quality was requested.
#[derive(Debug, Default)]
pub struct MeshCache(Mutex<HashMap<FileState, KnownMesh>>);

#[derive(Debug)]
struct KnownMesh {
    mesh: Arc<Mesh>,
    quality: Option<Arc<Quality>>,
}

/// State of a file: path, length in bytes and time of the last change.
type FileState = (PathBuf, u64, SystemTime);

impl MeshCache {
    /// The mesh of a gmsh file. The file is read only if it is not in the cache or has changed.
    ///
    /// # Errors
    /// As [`gmsh::read`].
    pub fn read(&self, path: &Path) -> Result<Arc<Mesh>> {
        let state =
            std::fs::metadata(path).and_then(|file| Ok((path.to_owned(), file.len(), file.modified()?)));
        let Ok(state) = state else { return Ok(Arc::new(gmsh::read(path)?)) };
        if let Some(known) = self.lock().get(&state) {
            return Ok(known.mesh.clone());
        }
        let mesh = Arc::new(gmsh::read(path)?);
        let mut known = self.lock();
        // Removes meshes of earlier states of the file.
        known.retain(|other, _| other.0 != path || *other == state);
        Ok(known.entry(state).or_insert(KnownMesh { mesh, quality: None }).mesh.clone())
    }

    /// Quality of a mesh. For a mesh in the cache, the quality is computed only once.
    ///
    /// # Errors
    /// As [`quality::check`].
    pub fn quality(&self, mesh: &Arc<Mesh>) -> Result<Arc<Quality>> {
        let is_same = |known: &&mut KnownMesh| Arc::ptr_eq(&known.mesh, mesh);
        if let Some(quality) = self.lock().values_mut().find(is_same).and_then(|known| known.quality.clone())
        {
            return Ok(quality);
        }
        let quality = Arc::new(quality::check(mesh)?);
        if let Some(known) = self.lock().values_mut().find(is_same) {
            known.quality = Some(quality.clone());
        }
        Ok(quality)
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<FileState, KnownMesh>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_TETRAHEDRON: &str = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n\
        $Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n";

    /// Truth: an unchanged file is read once; a changed file is read again.
    #[test]
    fn files_are_read_once_unless_they_change() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("one.msh");
        std::fs::write(&path, ONE_TETRAHEDRON).unwrap();
        let meshes = MeshCache::default();
        let first = meshes.read(&path).unwrap();
        assert!(Arc::ptr_eq(&first, &meshes.read(&path).unwrap()));
        let quality = meshes.quality(&first).unwrap();
        assert!((quality.volume - 1.0 / 6.0).abs() < 1e-15);
        assert!(Arc::ptr_eq(&quality, &meshes.quality(&first).unwrap()));
        std::fs::write(&path, ONE_TETRAHEDRON.replace("4 0 0 1\n", "4 0 0 1.5\n")).unwrap();
        let changed = meshes.read(&path).unwrap();
        assert_eq!(changed.points[3], [0.0, 0.0, 1.5]);
        assert!((meshes.quality(&changed).unwrap().volume - 0.25).abs() < 1e-15);
    }
}
