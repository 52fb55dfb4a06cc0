// Which requests begin a motion, or keep one going: none of them is about a moment that is over.
const kBeginners = new Set([
  "move", "move line", "move path", "follow", "jog", "home", "resume", "arm", "arm line", "release",
]);

export function beginsMotion(request: string, fields: object): boolean {
  if (!kBeginners.has(request)) return false;
  const told = fields as { dry_run?: unknown; speed?: unknown; renew?: unknown };
  if (told.dry_run === true) return false;
  return request !== "jog" || told.renew === true || told.speed !== 0;
}
