//! Contents of the sections of a .msh file, with the node and element numbers of the file.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::cursor::Cursor;
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::mesh::{CellBlock, CellRef, Mesh, PhysicalGroup};

struct RawBlock {
    kind: ElementKind,
    nodes: Vec<u64>,
    tags: Vec<u64>,
    /// Index into [`RawMesh::group_sets`] for each element.
    sets: Vec<u32>,
}

pub(super) struct RawElement<'a> {
    pub(super) kind: ElementKind,
    pub(super) tag: u64,
    pub(super) nodes: &'a [u64],
    pub(super) group_set: u32,
}

#[derive(Default)]
pub(super) struct RawMesh {
    /// Names of physical groups by dimension and tag.
    pub(super) names: BTreeMap<(usize, i64), String>,
    /// Index into `group_sets` of each entity, by dimension and tag (version 4.1).
    pub(super) entities: HashMap<(usize, i64), u32>,
    pub(super) has_entities: bool,
    node_tags: Vec<u64>,
    points: Vec<[f64; 3]>,
    nodes_read: bool,
    elements_read: bool,
    blocks: Vec<RawBlock>,
    /// Distinct sets of the tags of physical groups.
    group_sets: Vec<Vec<i64>>,
    set_index: HashMap<Vec<i64>, u32>,
    /// Dimension and tag of undeclared entities that have elements.
    undeclared: Vec<(usize, i64)>,
}

impl RawMesh {
    pub(super) fn start_nodes(&mut self, cursor: &Cursor, n: usize) -> Result<()> {
        if std::mem::replace(&mut self.nodes_read, true) {
            return Err(cursor.fail("the section of nodes appears twice in the file"));
        }
        self.node_tags.reserve(n);
        self.points.reserve(n);
        Ok(())
    }

    pub(super) fn start_elements(&mut self, cursor: &Cursor) -> Result<()> {
        if std::mem::replace(&mut self.elements_read, true) {
            return Err(cursor.fail("the section of elements appears twice in the file"));
        }
        Ok(())
    }

    pub(super) fn add_node(&mut self, tag: u64, x: [f64; 3]) {
        self.node_tags.push(tag);
        self.points.push(x);
    }

    pub(super) fn add_element(&mut self, element: RawElement) {
        let at = self.blocks.iter().position(|block| block.kind == element.kind).unwrap_or_else(|| {
            self.blocks.push(RawBlock { kind: element.kind, nodes: vec![], tags: vec![], sets: vec![] });
            self.blocks.len() - 1
        });
        let block = &mut self.blocks[at];
        block.nodes.extend_from_slice(element.nodes);
        block.tags.push(element.tag);
        block.sets.push(element.group_set);
    }

    pub(super) fn kind(&self, cursor: &Cursor, code: u64) -> Result<ElementKind> {
        u32::try_from(code).ok().and_then(ElementKind::from_gmsh_code).ok_or_else(|| {
            let known: Vec<String> =
                ElementKind::ALL.iter().map(|kind| format!("{} {}", kind.gmsh_code(), kind.name())).collect();
            cursor.fail(&format!(
                "element type {code} is not supported. Supported are the types of order 1 and 2 ({}); save the mesh with Mesh.ElementOrder = 1 or 2",
                known.join(", ")
            ))
        })
    }

    /// Index of a set of tags of physical groups. A new set is added.
    pub(super) fn group_set_index(&mut self, tags: &[i64]) -> u32 {
        if let Some(&at) = self.set_index.get(tags) {
            return at;
        }
        let at = self.group_sets.len() as u32;
        self.group_sets.push(tags.to_vec());
        self.set_index.insert(tags.to_vec(), at);
        at
    }

    /// Index of the group set of an entity. An entity that the file does not declare has the empty set.
    pub(super) fn entity_set(&mut self, dim: usize, tag: i64) -> u32 {
        if let Some(&set) = self.entities.get(&(dim, tag)) {
            return set;
        }
        self.undeclared.push((dim, tag));
        self.group_set_index(&[])
    }

    pub(super) fn into_mesh(mut self, source: &str) -> Result<Mesh> {
        let fail = |what: String| Error::input(format!("{source}: {what}"));
        if !self.nodes_read || !self.elements_read {
            let missing = if self.nodes_read { "$Elements" } else { "$Nodes" };
            return Err(fail(format!(
                "the file has no {missing} section; mesh the geometry before saving it"
            )));
        }
        if self.has_entities && !self.undeclared.is_empty() {
            let (dim, tag) = self.undeclared[0];
            return Err(fail(format!(
                "elements belong to the entity {tag} of dimension {dim}, which $Entities does not contain"
            )));
        }
        self.check_element_tags().map_err(&fail)?;
        let index = NodeIndex::new(&self.node_tags).map_err(&fail)?;
        let mut mesh =
            Mesh { source: source.to_string(), points: std::mem::take(&mut self.points), ..Mesh::default() };
        let mut groups = Groups::default();
        for block in &self.blocks {
            self.renumber_block(block, &index, &mut mesh, &mut groups).map_err(&fail)?;
        }
        mesh.groups = groups.finish(self.names);
        drop_unused_points(&mut mesh, &self.node_tags);
        Ok(mesh)
    }

    fn check_element_tags(&self) -> std::result::Result<(), String> {
        let n = self.blocks.iter().map(|block| block.tags.len()).sum();
        let mut seen = HashSet::with_capacity(n);
        for &tag in self.blocks.iter().flat_map(|block| &block.tags) {
            if !seen.insert(tag) {
                return Err(format!(
                    "the element number {tag} appears twice; each element needs its own number"
                ));
            }
        }
        Ok(())
    }

    /// In version 2.2, an element is repeated for each further physical group. The repetitions become one cell in several groups.
    fn renumber_block(
        &self,
        raw: &RawBlock,
        index: &NodeIndex,
        mesh: &mut Mesh,
        groups: &mut Groups,
    ) -> std::result::Result<(), String> {
        let n = raw.kind.n_nodes();
        let i_block = mesh.blocks.len();
        let mut block =
            CellBlock { kind: raw.kind, nodes: Vec::with_capacity(raw.nodes.len()), tags: Vec::new() };
        let mut first: HashMap<&[u64], usize> = HashMap::with_capacity(raw.tags.len());
        for ((nodes, &tag), &set) in raw.nodes.chunks_exact(n).zip(&raw.tags).zip(&raw.sets) {
            let cell = *first.entry(nodes).or_insert(block.tags.len());
            let physical = &self.group_sets[set as usize];
            if cell == block.tags.len() {
                block.tags.push(tag);
                for &node in nodes {
                    block.nodes.push(index.find(node).ok_or_else(|| {
                        format!(
                            "element {tag} ({}) refers to node {node}, which the file does not contain",
                            raw.kind.name()
                        )
                    })?);
                }
                check_distinct(nodes, tag, raw.kind)?;
            } else if physical.is_empty() {
                return Err(repeated(tag, block.tags[cell]));
            }
            let at = CellRef { block: i_block, cell };
            for &group in physical {
                if !groups.add((raw.kind.dim(), group), at) {
                    return Err(repeated(tag, block.tags[cell]));
                }
            }
        }
        mesh.blocks.push(block);
        Ok(())
    }
}

fn repeated(tag: u64, other: u64) -> String {
    format!(
        "the elements {other} and {tag} have the same nodes and are not in different physical groups; remove one \
         (in gmsh: `Coherence Mesh` removes duplicates)"
    )
}

fn check_distinct(nodes: &[u64], tag: u64, kind: ElementKind) -> std::result::Result<(), String> {
    for (i, node) in nodes.iter().enumerate() {
        if nodes[..i].contains(node) {
            return Err(format!(
                "element {tag} ({}) contains node {node} twice; collapsed elements are not allowed",
                kind.name()
            ));
        }
    }
    Ok(())
}

/// Index of each node by its number: a table for dense numbers, a map for sparse numbers.
enum NodeIndex {
    Dense(Vec<usize>),
    Sparse(HashMap<u64, usize>),
}

impl NodeIndex {
    fn new(tags: &[u64]) -> std::result::Result<Self, String> {
        let largest = tags.iter().copied().max().unwrap_or(0);
        let twice = |tag: u64| format!("the node number {tag} appears twice; each node needs its own number");
        if largest < 4 * tags.len() as u64 + 64 {
            let mut table = vec![usize::MAX; largest as usize + 1];
            for (i, &tag) in tags.iter().enumerate() {
                if std::mem::replace(&mut table[tag as usize], i) != usize::MAX {
                    return Err(twice(tag));
                }
            }
            return Ok(Self::Dense(table));
        }
        let mut map = HashMap::with_capacity(tags.len());
        for (i, &tag) in tags.iter().enumerate() {
            if map.insert(tag, i).is_some() {
                return Err(twice(tag));
            }
        }
        Ok(Self::Sparse(map))
    }

    fn find(&self, tag: u64) -> Option<usize> {
        match self {
            Self::Dense(table) => table.get(usize::try_from(tag).ok()?).copied().filter(|&i| i != usize::MAX),
            Self::Sparse(map) => map.get(&tag).copied(),
        }
    }
}

#[derive(Default)]
struct Groups(BTreeMap<(usize, i64), (Vec<CellRef>, HashSet<CellRef>)>);

impl Groups {
    /// Adds a cell; returns `false` if the group already has it.
    fn add(&mut self, group: (usize, i64), cell: CellRef) -> bool {
        let (cells, known) = self.0.entry(group).or_default();
        cells.push(cell);
        known.insert(cell)
    }

    /// Groups in order of dimension and tag, including groups with a name and no cells.
    fn finish(mut self, names: BTreeMap<(usize, i64), String>) -> Vec<PhysicalGroup> {
        for &group in names.keys() {
            self.0.entry(group).or_default();
        }
        self.0
            .into_iter()
            .map(|((dim, tag), (cells, _))| {
                let name = names.get(&(dim, tag)).cloned().unwrap_or_else(|| tag.to_string());
                PhysicalGroup { name, dim, tag, cells }
            })
            .collect()
    }
}

/// Removes the points that no cell uses, such as centres of circles, which gmsh saves.
fn drop_unused_points(mesh: &mut Mesh, tags: &[u64]) {
    let mut used = vec![false; mesh.points.len()];
    for &node in mesh.blocks.iter().flat_map(|block| &block.nodes) {
        used[node] = true;
    }
    let Some(first) = used.iter().position(|used| !used) else { return };
    let mut to = vec![usize::MAX; used.len()];
    let mut kept = 0;
    for (node, _) in used.iter().enumerate().filter(|(_, used)| **used) {
        to[node] = kept;
        mesh.points[kept] = mesh.points[node];
        kept += 1;
    }
    mesh.points.truncate(kept);
    mesh.blocks.iter_mut().flat_map(|block| &mut block.nodes).for_each(|node| *node = to[*node]);
    mesh.warnings.push(format!(
        "{} nodes of {} were ignored, because no element uses them (first: node {})",
        used.len() - kept,
        mesh.source,
        tags[first]
    ));
}
