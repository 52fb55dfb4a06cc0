// What the browser keeps of this page. A browser that keeps nothing (a private window) is no error.
export function recall<T extends object>(key: string, standard: T): T {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(`bushd.${key}`) ?? "null");
    if (typeof kept === "object" && kept !== null) return { ...standard, ...kept };
  } catch {
    // Not ours, or not allowed.
  }
  return standard;
}

export function remember(key: string, value: object): void {
  try {
    localStorage.setItem(`bushd.${key}`, JSON.stringify(value));
  } catch {
    // Full, or not allowed.
  }
}
