// Figures as people read them.

export function duration(ms: number): string {
  const s = ms / 1000;
  if (s < 10) return s.toFixed(s < 1 ? 2 : 1) + ' s';
  if (s < 60) return Math.round(s) + ' s';
  if (s < 3600) return `${Math.floor(s / 60)}:${String(Math.round(s) % 60).padStart(2, '0')} min`;
  return `${Math.floor(s / 3600)}:${String(Math.floor(s / 60) % 60).padStart(2, '0')} h`;
}

export const clockTime = (ms: number) => new Date(ms).toLocaleTimeString([], {hour: '2-digit', minute: '2-digit', second: '2-digit'});

export function bytes(n: number): string {
  const units = ['B', 'kB', 'MB', 'GB', 'TB'];
  let i = 0;
  for (; n >= 1000 && i < units.length - 1; ++i) n /= 1000;
  return `${n < 10 && i > 0 ? n.toFixed(1) : Math.round(n)} ${units[i]}`;
}

export const gigabytes = (mb: number) => bytes(mb * 1e6);

export function figure(value: unknown): string {
  if (typeof value === 'number') return Number.isInteger(value) ? value.toLocaleString('en') : String(+value.toPrecision(4));
  if (Array.isArray(value)) return value.map(figure).join(', ');
  return typeof value === 'string' ? value : JSON.stringify(value);
}
