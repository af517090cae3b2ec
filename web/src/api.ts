// What the scheduler's HTTP API answers. Times in ms since 1970, durations in ms.

export type State = 'blocked' | 'ready' | 'leased' | 'running' | 'reconnect' | 'paused' | 'done' | 'skipped' | 'failed' |
    'quarantined' | 'aborted' | 'canceled';
export type Counts = Partial<Record<State, number>>;

export interface Shot {
  id: number;
  name: string;
  folder: string;
  state: string;
  error: string;
  until: string;
  submitted_ms: number;
  finished_ms: number | null;
  counts: Counts;
}
export interface Stage {
  kind: string;
  publishes: string;
  counts: Counts;
  wall_ms: number;
}
export interface Film {
  render: string;
  file: string;
  path: string;
}
export interface ShotDetail extends Shot {
  stages: Stage[];
  films: Film[];
  has_report: boolean;
}
export interface Job {
  id: number;
  name: string;
  kind: string;
  state: State;
  phase: string;
  progress: number;
  num_attempts: number;
  wall_ms: number;
  peak_rss_mb: number;
  reason: string;
  error_kind: string;
  error: string;
  has_preview: boolean;
  key: string;  // of its result; '' while its inputs are not known
}
export interface JobPage {
  total: number;
  jobs: Job[];
}
export interface Attempt {
  number: number;
  worker: string;
  state: string;
  outcome: string;
  error_kind: string;
  error: string;
  exit_code: number;
  signal: number;
  leased_ms: number;
  ended_ms: number | null;
  wall_ms: number;
  peak_rss_mb: number;
}
export interface JobDetail extends Job {
  shot_id: number;
  artifact: string;
  reproduce: string;
  cores: number;
  ram_mb: number;
  params: Record<string, unknown>;
  unit: Record<string, unknown>;
  figures: Record<string, unknown>;
  attempts: Attempt[];
  history: {at_ms: number; kind: string; text: string}[];
  inputs: {id: number; name: string; state: State}[];
  links: {from: string; to: string}[];
  files: {path: string; size: number}[];
}
export interface Worker {
  id: string;
  host: string;
  slots: number;
  cores: number;
  ram_mb: number;
  free_disk_mb: number;
  state: string;
  last_seen_ms: number;
  running: {id: number; name: string; phase: string; progress: number}[];
}

async function get<T>(path: string): Promise<T> {
  const response = await fetch('/api/v1' + path);
  if (!response.ok) throw new Error(((await response.json()) as {error: string}).error);
  return await response.json() as T;
}

export interface JobFilter {
  kind: string;
  state: string;
  text: string;
  offset: number;
  limit: number;
}

export const api = {
  shots: () => get<{shots: Shot[]}>('/shots').then(answer => answer.shots),
  shot: (id: number) => get<ShotDetail>(`/shots/${id}`),
  jobs: (shot: number, filter: Partial<JobFilter>) => {
    const query = new URLSearchParams();
    for (const [key, value] of Object.entries(filter)) if (value !== '') query.set(key, String(value));
    return get<JobPage>(`/shots/${shot}/jobs?${query}`);
  },
  job: (id: number) => get<JobDetail>(`/jobs/${id}`),
  log: async (id: number) => {
    const response = await fetch(`/api/v1/jobs/${id}/log?tail=65536`);
    return response.ok ? await response.text() : '';
  },
  workers: () => get<{workers: Worker[]}>('/workers').then(answer => answer.workers),
  retry: (id: number) => fetch(`/api/v1/jobs/${id}/retry`, {method: 'POST', headers: {'X-Vantage': '1'}}),
  preview: (id: number, key: string) => `/api/v1/jobs/${id}/preview?k=${key}`,
  out: (shot: number, path: string) => `/api/v1/shots/${shot}/out/${path}`,
};
