/** Times, sizes and days as people read them. */

/** "0:07.3", "12:41.0", "1:02:03.4". */
export function clock(seconds: number): string {
  const tenths = Math.round(10 * Math.max(0, seconds));
  const s = (tenths % 600) / 10;
  const minutes = Math.floor(tenths / 600);
  const tail = s.toFixed(1).padStart(4, "0");
  if (minutes < 60) return `${minutes}:${tail}`;
  return `${Math.floor(minutes / 60)}:${String(minutes % 60).padStart(2, "0")}:${tail}`;
}

/** "812 B", "34 kB", "2.1 MB". */
export function bytes(count: number): string {
  if (count < 1000) return `${count} B`;
  if (count < 1e6) return `${Math.round(count / 1e3)} kB`;
  return count < 1e9 ? `${(count / 1e6).toFixed(1)} MB` : `${(count / 1e9).toFixed(1)} GB`;
}

/** "21 Nov 08:41", in the place's own time. */
export function day(seconds: number): string {
  return new Date(1e3 * seconds).toLocaleString("en-GB", {
    day: "numeric",
    month: "short",
    hour: "2-digit",
    minute: "2-digit",
  });
}

/** Why no file can be called so, in words; null where one can. */
export function nameProblem(name: string): string | null {
  if (/^[A-Za-z0-9][A-Za-z0-9_-]{0,63}$/.test(name)) return null;
  const odd = [...new Set([...name].filter((letter) => !/[A-Za-z0-9_-]/.test(letter)))];
  const not = odd.length > 0 ? `; not ${odd.map((letter) => (letter === " " ? "a space" : letter)).join(", ")}` : "";
  return `A name has letters from a to z, digits, dashes and underscores, and begins with a letter or a digit${not}.`;
}
