/** What the sheet's triangles say once and for all: areas, neighbours, and what follows from them
 * per frame: values at the nodes and the contours of labelled regions. */

export interface Topology {
  readonly nPoints: number;
  readonly nCells: number;
  readonly points: Float32Array;
  /** Three points of each cell, counter-clockwise. */
  readonly cells: Uint32Array;
  /** The cell across edge (k, k+1) of each cell, -1 at the rim; three per cell. */
  readonly across: Int32Array;
  readonly areas: Float32Array;
  /** 1 / (sum of the areas around a node). */
  readonly nodeWeights: Float32Array;
}

function signedArea(points: ArrayLike<number>, a: number, b: number, c: number): number {
  const ux = points[2 * b] - points[2 * a];
  const uy = points[2 * b + 1] - points[2 * a + 1];
  const vx = points[2 * c] - points[2 * a];
  const vy = points[2 * c + 1] - points[2 * a + 1];
  return (ux * vy - uy * vx) / 2;
}

/** Prepare flat points (x, y) and flat cells (three each). */
export function prepareTopology(flatPoints: readonly number[], flatCells: readonly number[]) {
  const points = Float32Array.from(flatPoints);
  const cells = Uint32Array.from(flatCells);
  const nCells = cells.length / 3;
  const nPoints = points.length / 2;
  const areas = new Float32Array(nCells);
  const around = new Float32Array(nPoints);
  const across = new Int32Array(3 * nCells).fill(-1);
  const edges = new Map<number, number>();
  for (let c = 0; c < nCells; c++) {
    const area = signedArea(flatPoints, cells[3 * c], cells[3 * c + 1], cells[3 * c + 2]);
    if (area < 0) [cells[3 * c + 1], cells[3 * c + 2]] = [cells[3 * c + 2], cells[3 * c + 1]];
    areas[c] = Math.abs(area);
    for (let k = 0; k < 3; k++) {
      const from = cells[3 * c + k];
      const to = cells[3 * c + ((k + 1) % 3)];
      around[from] += areas[c];
      const twin = edges.get(to * nPoints + from);
      if (twin === undefined) edges.set(from * nPoints + to, 3 * c + k);
      else {
        across[3 * c + k] = Math.floor(twin / 3);
        across[twin] = c;
      }
    }
  }
  const nodeWeights = around.map((area) => (area > 0 ? 1 / area : 0));
  return { nPoints, nCells, points, cells, across, areas, nodeWeights } satisfies Topology;
}

/** Area-weighted means of the cells around each node, into `out` (at least nPoints long). */
export function toNodes(topology: Topology, values: Float32Array, out: Float32Array): void {
  const { cells, areas, nodeWeights, nCells, nPoints } = topology;
  out.fill(0);
  for (let c = 0; c < nCells; c++) {
    const weighted = values[c] * areas[c];
    out[cells[3 * c]] += weighted;
    out[cells[3 * c + 1]] += weighted;
    out[cells[3 * c + 2]] += weighted;
  }
  for (let p = 0; p < nPoints; p++) out[p] *= nodeWeights[p];
}

/** The closed boundaries of each label 1…n, as loops of point indices, region on the left. */
export function contours(topology: Topology, labels: Uint8Array, n: number): number[][][] {
  const { cells, across, nCells } = topology;
  const next: Map<number, number>[] = Array.from({ length: n }, () => new Map());
  for (let c = 0; c < nCells; c++) {
    const label = labels[c];
    if (label === 0 || label > n) continue;
    for (let k = 0; k < 3; k++) {
      const other = across[3 * c + k];
      if (other >= 0 && labels[other] === label) continue;
      next[label - 1].set(cells[3 * c + k], cells[3 * c + ((k + 1) % 3)]);
    }
  }
  return next.map(loops);
}

function loops(next: Map<number, number>): number[][] {
  const found: number[][] = [];
  for (const start of next.keys()) {
    const loop: number[] = [];
    for (let at: number | undefined = start; at !== undefined && next.has(at); ) {
      loop.push(at);
      const following: number | undefined = next.get(at);
      next.delete(at);
      at = following;
    }
    if (loop.length > 2) found.push(loop);
  }
  return found;
}
