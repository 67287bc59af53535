/** A bend as two small drawings: the sheet from the side, and its axis on the sheet from above. */

const FLAT = 26;
const ARC = 26;
const STEPS = 16;

/** The sheet from the side, its middle up: flat, an arc of `angle` rad, flat. */
export function profile(angle: number): readonly (readonly [number, number])[] {
  const side = (turn: number, sign: 1 | -1): (readonly [number, number])[] => {
    const points: (readonly [number, number])[] = [];
    let [x, y] = [0, 0];
    for (let k = 0; k < STEPS; k++) {
      const direction = (turn * (k + 0.5)) / STEPS;
      x += ((sign * ARC) / 2 / STEPS) * Math.cos(direction);
      y -= (ARC / 2 / STEPS) * Math.sin(direction);
      points.push([x, y]);
    }
    points.push([x + sign * FLAT * Math.cos(turn), y - FLAT * Math.sin(turn)]);
    return points;
  };
  return [...side(angle / 2, -1).reverse(), [0, 0], ...side(angle / 2, 1)];
}

export function BendFigure({ angle, axis }: { readonly angle: number; readonly axis: number | null }) {
  const points = profile(angle);
  const middle = points.reduce((sum, [, y]) => sum + y, 0) / points.length;
  const line = points.map(([x, y]) => `${x.toFixed(1)},${(middle - y).toFixed(1)}`).join(" ");
  const [c, s] = [Math.cos(axis ?? 0), Math.sin(axis ?? 0)];
  return (
    <svg class="bent" viewBox="-44 -24 126 48" aria-hidden="true">
      <polyline points={line} />
      {axis !== null && (
        <g transform="translate(64 0)">
          <circle r="15" />
          <line x1={-15 * c} y1={15 * s} x2={15 * c} y2={-15 * s} />
        </g>
      )}
    </svg>
  );
}
