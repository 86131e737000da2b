//! Size field as a post-processing view of gmsh (.pos, text), for `gmsh -bgm`.

use std::io::{self, Write};

use crate::mesh::Mesh;

/// Writes `sizes` at the mesh points as a view on the corners of the solids, after the `comment` lines.
///
/// # Errors
/// If writing to `out` fails.
pub fn write_size_field(
    out: &mut dyn Write,
    mesh: &Mesh,
    sizes: &[f64],
    comment: &[String],
) -> io::Result<()> {
    for line in comment {
        writeln!(out, "// {line}")?;
    }
    writeln!(out, "View \"size\" {{")?;
    for cell in mesh.volume_cells() {
        let kind = mesh.kind(cell);
        let corners = &mesh.cell_nodes(cell)[..kind.n_corners()];
        let name = match corners.len() {
            4 => "SS",
            5 => "SY",
            6 => "SI",
            _ => "SH",
        };
        let list = |values: Vec<String>| values.join(",");
        let at = corners.iter().flat_map(|&node| mesh.points[node]).map(|x| format!("{x:.9e}")).collect();
        let values = corners.iter().map(|&node| format!("{:.6e}", sizes[node])).collect();
        writeln!(out, "{name}({}){{{}}};", list(at), list(values))?;
    }
    writeln!(out, "}};")
}
