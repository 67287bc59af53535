//! Which columns of a factor are eliminated together.
//!
//! Columns of one pattern share a panel, and a panel takes in its children where the zeros that come
//! with it cost less than a panel more (Ashcraft & Grimes 1989). Small panels are what a factor of a
//! mesh is made of, and most of their time is not arithmetic.

/// No panel.
const NONE: u32 = u32::MAX;

/// A panel so far.
#[derive(Clone, Debug)]
struct Node {
    width: usize,
    below: usize,
    children: Vec<u32>,
    /// First columns of the runs that it is made of.
    runs: Vec<u32>,
}

/// What a panel takes in a factor and a solve, in the time of one multiplication in a tile.
fn cost(width: usize, below: usize, entry: f64) -> f64 {
    let (width, below) = (width as f64, below as f64);
    let height = width + below;
    let multiplications = width * height * height / 2.0;
    PANEL + entry * width * height + SQUARE * below * below + multiplications
}

/// Loops that begin and end, whatever their length.
const PANEL: f64 = 3000.0;
/// A value is cleared, gathered, written and read by two substitutions.
pub const ENTRY: f64 = 80.0;
/// The same without substitutions, nor a factor that is kept.
pub const PASSING: f64 = 20.0;
/// Half of the square below is cleared, handed on and added to the parent.
const SQUARE: f64 = 20.0;

/// The columns in an order that fills in the same, and the first column of each panel, then the size.
///
/// The columns are given in postorder: for each, its parent in the elimination tree, and the number
/// of its entries in the factor. `entry`: what each of these takes.
pub fn amalgamated(parent: &[u32], counts: &[u32], entry: f64) -> (Vec<u32>, Vec<u32>) {
    let starts = runs(parent, counts);
    let mut run_of = vec![0; parent.len()];
    for (number, ends) in (0..).zip(starts.windows(2)) {
        run_of[ends[0] as usize..ends[1] as usize].fill(number);
    }
    let mut nodes: Vec<Node> = Vec::with_capacity(starts.len());
    let mut waiting: Vec<Vec<u32>> = vec![Vec::new(); starts.len()];
    let mut roots = Vec::new();
    for (number, ends) in (0..).zip(starts.windows(2)) {
        let last = ends[1] as usize - 1;
        let mut node = Node {
            width: (ends[1] - ends[0]) as usize,
            below: counts[last] as usize - 1,
            children: Vec::new(),
            runs: vec![ends[0]],
        };
        take_in(
            &mut node,
            std::mem::take(&mut waiting[number as usize]),
            &mut nodes,
            entry,
        );
        nodes.push(node);
        match parent[last] {
            NONE => roots.push(number),
            parent => waiting[run_of[parent as usize] as usize].push(number),
        }
    }
    laid_out(&nodes, &roots, &starts, &run_of)
}

/// First column of each run of columns of one pattern, then the size.
fn runs(parent: &[u32], counts: &[u32]) -> Vec<u32> {
    let size = counts.len();
    let begins = |&j: &usize| j == 0 || parent[j - 1] != j as u32 || counts[j - 1] != counts[j] + 1;
    let starts = (0..size).filter(begins).map(|j| j as u32);
    starts.chain([size as u32]).collect()
}

/// Gives a panel its children, or what they are made of where that costs less.
fn take_in(node: &mut Node, mut children: Vec<u32>, nodes: &mut [Node], entry: f64) {
    // those with most in common first
    children.sort_by_key(|&child| std::cmp::Reverse(nodes[child as usize].below));
    for number in children {
        let child = &nodes[number as usize];
        let width = node.width + child.width;
        let apart = cost(node.width, node.below, entry) + cost(child.width, child.below, entry);
        if cost(width, node.below, entry) > apart {
            node.children.push(number);
            continue;
        }
        node.width = width;
        let child = &mut nodes[number as usize];
        node.children.append(&mut child.children);
        node.runs.append(&mut child.runs);
    }
    node.children.sort_unstable();
}

/// The columns panel by panel, each panel after its children; first column of each, then the size.
fn laid_out(nodes: &[Node], roots: &[u32], starts: &[u32], run_of: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let mut order = Vec::with_capacity(run_of.len());
    let mut first = vec![0];
    let mut path: Vec<(u32, usize)> = Vec::new();
    for &root in roots {
        path.push((root, 0));
        while let Some((number, done)) = path.last_mut() {
            let node = &nodes[*number as usize];
            if let Some(&child) = node.children.get(*done) {
                *done += 1;
                path.push((child, 0));
                continue;
            }
            let mut runs = node.runs.clone();
            runs.sort_unstable();
            for start in runs {
                order.extend(start..starts[run_of[start as usize] as usize + 1]);
            }
            first.push(order.len() as u32);
            path.pop();
        }
    }
    (order, first)
}
