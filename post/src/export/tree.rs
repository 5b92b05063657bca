//! The tree as VTK's HyperTreeGrid (XML, version 2.0), which keeps the hierarchy: for filters and pictures by
//! level.
//!
//! Each root octant is a tree. Its cells come level by level, families in the order of their parents, the
//! first axis fastest within a family. A bit for each cell above the deepest level says whether it is
//! refined.
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::Path;

use crate::frame::{LeafField, Leaves};
use agimp::io::hdf5_file::FileError;
use agimp::io::snapshot::Header;
use agimp::io::whole_file::{system, write_in_pieces};

/// Level and place of a cell, counted in cells of its level from the lower corner of the domain.
type Cell = (u8, [u32; 3]);

/// The tree of an output.
pub struct Tree {
    header: Header,
    leaves: Leaves,
    fields: Vec<LeafField>,
}

/// The cells of all trees, tree by tree, in the order of the file.
#[derive(Default)]
struct Cells {
    /// Levels of each tree.
    depths: Vec<u64>,
    /// Cells of each level of each tree.
    counts: Vec<u64>,
    /// Whether cells are refined, but for those of the deepest level of each tree.
    refined: Vec<u8>,
    /// All cells: its level, and the leaf or the first of its children, which lie side by side.
    all: Vec<(u8, Content)>,
}

#[derive(Clone, Copy)]
enum Content {
    Leaf(usize),
    Children(usize),
}

impl Tree {
    /// Reads the tree of an output or checkpoint: of the tree file beside it, or of its restart state.
    ///
    /// # Errors
    /// The file cannot be read or is damaged, or there is no tree.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (header, leaves, fields) = Leaves::with_fields(path)?;
        if leaves.levels.is_empty() {
            let reason = "found neither a tree file beside it nor a restart state in it; expected one of them: set `output.tree = true`";
            return Err(FileError::Refused { path: path.into(), reason: reason.into() });
        }
        Ok(Self { header, leaves, fields })
    }

    /// Number of leaves.
    pub fn leaf_count(&self) -> usize {
        self.leaves.levels.len()
    }

    /// Not collective. Writes the tree, under a temporary name first.
    ///
    /// # Errors
    /// The file cannot be written, or the leaves do not fill the domain.
    pub fn write(&self, path: &Path) -> Result<(), FileError> {
        let cells = self.cells().ok_or_else(|| FileError::Refused {
            path: path.into(),
            reason:
                "the leaves of the output do not make a tree; is it damaged? `agimp info --verify` checks it"
                    .into(),
        })?;
        write_in_pieces(path, |out| self.put(out, &cells)).map_err(|source| system(path, "write", source))
    }

    /// All cells; `None` if a leaf is missing.
    fn cells(&self) -> Option<Cells> {
        let dimension = self.header.dimension;
        let leaves = self.leaves.levels.iter().zip(&self.leaves.coords).enumerate();
        let leaves: BTreeMap<Cell, usize> =
            leaves.map(|(leaf, (&level, &coord))| ((level, coord), leaf)).collect();
        let deepest = self.leaves.levels.iter().max().copied()?;
        let mut cells = Cells::default();
        for root in self.roots() {
            let (mut level, mut row) = (0, vec![root]);
            let first = cells.depths.len();
            cells.depths.push(0);
            while !row.is_empty() {
                cells.depths[first] += 1;
                cells.counts.push(row.len() as u64);
                let mut next = Vec::new();
                let behind = cells.all.len() + row.len();
                let start = cells.refined.len();
                for coord in row {
                    let leaf = leaves.get(&(level, coord)).copied();
                    cells.refined.push(u8::from(leaf.is_none()));
                    cells
                        .all
                        .push((level, leaf.map_or(Content::Children(behind + next.len()), Content::Leaf)));
                    if leaf.is_none() {
                        if level == deepest {
                            return None;
                        }
                        let child =
                            |number: u32| std::array::from_fn(|axis| 2 * coord[axis] + (number >> axis & 1));
                        next.extend((0..1u32 << dimension).map(child));
                    }
                }
                if next.is_empty() {
                    // No cells below: the deepest level needs no bits.
                    cells.refined.truncate(start);
                }
                (level, row) = (level + 1, next);
            }
        }
        Some(cells)
    }

    /// Places of the root octants, the first axis fastest.
    fn roots(&self) -> impl Iterator<Item = [u32; 3]> {
        let [x, y, z] = std::array::from_fn(|axis| self.header.roots.get(axis).map_or(1, |&n| n as u32));
        (0..z).flat_map(move |k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])))
    }

    /// Values of a field on all cells: its own for a leaf, the sum or mean of the children for another cell.
    fn on_cells(&self, cells: &Cells, field: &LeafField) -> Vec<f64> {
        let children = 1_usize << self.header.dimension;
        let mut values = vec![0.0; cells.all.len()];
        // Children come behind their parents.
        for (cell, (_, content)) in cells.all.iter().enumerate().rev() {
            values[cell] = match *content {
                Content::Leaf(leaf) => field.values[leaf],
                Content::Children(first) => {
                    let sum = values[first..first + children].iter().sum::<f64>();
                    if field.is_sum { sum } else { sum / children as f64 }
                }
            };
        }
        values
    }

    fn put(&self, out: &mut impl Write, cells: &Cells) -> io::Result<()> {
        let points = |axis: usize| self.header.roots.get(axis).map_or(1, |&n| n + 1);
        writeln!(
            out,
            "<?xml version=\"1.0\"?>\n\
             <VTKFile type=\"HyperTreeGrid\" version=\"2.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n\
             <HyperTreeGrid BranchFactor=\"2\" TransposedRootIndexing=\"0\" Dimensions=\"{} {} {}\">\n\
             <Grid>",
            points(0),
            points(1),
            points(2)
        )?;
        for (axis, name) in ["XCoordinates", "YCoordinates", "ZCoordinates"].into_iter().enumerate() {
            let low = self.header.origin.get(axis).copied().unwrap_or(0.0);
            let edges = (0..points(axis)).map(|i| low + i as f64 * self.header.root_edge);
            array(out, "Float64", name, edges.collect::<Vec<_>>())?;
        }
        writeln!(out, "</Grid>\n<Trees>")?;
        array(out, "Bit", "Descriptors", cells.refined.iter().copied())?;
        array(out, "Int64", "NumberOfVerticesPerDepth", cells.counts.iter().copied())?;
        array(out, "Int64", "TreeIds", 0..cells.depths.len())?;
        array(out, "UInt32", "DepthPerTree", cells.depths.iter().copied())?;
        writeln!(out, "</Trees>\n<CellData>")?;
        array(out, "UInt8", "level", cells.all.iter().map(|(level, _)| *level))?;
        for field in &self.fields {
            array(out, "Float64", field.name, self.on_cells(cells, field))?;
        }
        writeln!(out, "</CellData>\n<FieldData>")?;
        array(out, "Float64", "TimeValue", [self.header.time])?;
        writeln!(out, "</FieldData>\n</HyperTreeGrid>\n</VTKFile>")
    }
}

/// A data array as text, sixteen numbers to a line.
fn array<T: std::fmt::Debug>(
    out: &mut impl Write,
    kind: &str,
    name: &str,
    values: impl IntoIterator<Item = T, IntoIter: ExactSizeIterator>,
) -> io::Result<()> {
    let values = values.into_iter();
    let count = values.len();
    write!(
        out,
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"1\" NumberOfTuples=\"{count}\" format=\"ascii\">"
    )?;
    for (number, value) in values.enumerate() {
        write!(out, "{}{value:?}", if number % 16 == 0 { '\n' } else { ' ' })?;
    }
    writeln!(out, "\n</DataArray>")
}
