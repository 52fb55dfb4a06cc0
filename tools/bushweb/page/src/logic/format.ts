// Numbers as people read them. "-" is ASCII, so that what is copied can be typed in again.

export const kNothing = "–";

export function fixed(value: number | null | undefined, decimals: number): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return kNothing;
  const text = value.toFixed(Math.min(Math.max(Math.trunc(decimals) || 0, 0), 20));
  return /^-[0.]*$/.test(text) ? text.slice(1) : text; // no "-0.00"
}

// With so many digits as say something: 0.00123, 12.3, 4560.
export function short(value: number | null | undefined, digits = 4): string {
  if (value === null || value === undefined || !Number.isFinite(value)) return kNothing;
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e7 || size < 1e-4) return value.toExponential(digits - 1);
  const decimals = Math.max(0, digits - 1 - Math.floor(Math.log10(size)));
  const text = value.toFixed(Math.min(decimals, 12));
  return text.includes(".") ? text.replace(/\.?0+$/, "") : text;
}

// How long ago: "1.2 s", "45 s", "3 min", "2 h", "5 d".
export function age(ms: number): string {
  if (!Number.isFinite(ms)) return "never heard";
  const seconds = Math.max(0, ms / 1000);
  if (seconds < 10) return `${(Math.floor(seconds * 10) / 10).toFixed(1)} s`;
  if (seconds < 60) return `${Math.floor(seconds)} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  if (seconds < 86_400) return `${Math.floor(seconds / 3600)} h`;
  return `${Math.floor(seconds / 86_400)} d`;
}

// How long something takes: "0.35 s", "12.5 s", "3 min 20 s".
export function duration(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return kNothing;
  if (seconds < 10) return `${seconds.toFixed(2)} s`;
  if (seconds < 59.95) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  const hours = Math.floor(whole / 3600);
  const minutes = Math.floor((whole % 3600) / 60);
  if (hours > 0) return `${hours} h ${minutes} min`;
  return `${minutes} min ${whole % 60} s`;
}

// Microseconds since 1970 as local date and time, to the second.
export function dateTime(utimeUs: number): string {
  const date = new Date(utimeUs / 1000);
  if (Number.isNaN(date.getTime())) return kNothing;
  const two = (n: number): string => String(n).padStart(2, "0");
  return (
    `${date.getFullYear()}-${two(date.getMonth() + 1)}-${two(date.getDate())} ` +
    `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}`
  );
}

export function microseconds(us: number | null): string {
  if (us === null) return "longer";
  if (us < 1000) return `${us} us`;
  return `${short(us / 1000, 3)} ms`;
}

// A number that somebody has typed: with a point or a comma, nothing else. undefined: it is none.
export function parseNumber(text: string): number | undefined {
  const plain = text.trim().replace(",", ".").replace(/^\+/, "").replace(/^−/, "-");
  if (!/^-?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$/.test(plain)) return undefined;
  const value = Number(plain);
  return Number.isFinite(value) ? value : undefined;
}

// A greatest speed that somebody has typed: 0, no limit, only where nothing stands. undefined: it is
// none, such as a 0, which would be no limit to the daemon.
export function parseSpeed(text: string): number | undefined {
  if (text.trim() === "") return 0;
  const speed = parseNumber(text);
  return speed !== undefined && speed > 0 ? speed : undefined;
}

export function noSpeed(text: string): string {
  return `"${text}" is no speed; allowed: a number above 0`;
}

// 1, 2 or 5 times a power of ten, not above the value.
export function roundDown125(value: number): number {
  if (!(value > 0) || !Number.isFinite(value)) return 1;
  const power = Math.floor(Math.log10(value));
  const scale = 10 ** power;
  const lead = value / scale;
  const digit = lead >= 5 ? 5 : lead >= 2 ? 2 : 1;
  return Number(`${digit}e${power}`);
}
