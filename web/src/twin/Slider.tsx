/** A slider with its name before it and its value behind it. */

interface SliderProps {
  readonly name: string;
  readonly id: string;
  readonly low: number;
  readonly high: number;
  readonly step: number;
  readonly value: number;
  /** The value as people read it. */
  readonly words: string;
  readonly set: (value: number) => void;
}

export function Slider({ name, id, low, high, step, value, words, set }: SliderProps) {
  return (
    <label class="range">
      {name}
      <input
        type="range"
        data-testid={id}
        min={low}
        max={high}
        step={step}
        value={value}
        aria-valuetext={words}
        onInput={(event) => set(Number(event.currentTarget.value))}
      />
      <output>{words}</output>
    </label>
  );
}
