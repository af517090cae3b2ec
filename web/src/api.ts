// What the scheduler's HTTP API answers. Times in ms since 1970, durations in ms.
import {authorization} from './token';

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
  total: number | null;  // null in a list by name
  jobs: Job[];
  after: string | null;  // where the next page begins
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
  trouble: string;
  hours: string;
  set_aside: string;
  running: {id: number; name: string; phase: string; progress: number}[];
}

export interface Estimate {
  rest: {low_s: number; middle_s: number; high_s: number; unknown_kinds: string[]} | null;
  why: string;
}
export interface Session {
  who: string;
  role: 'read' | 'operate';
}
export interface Health {
  ok: boolean;
  trouble: string;
}
export interface OrderResult {
  num_changed: number;
  text: string;
  affected: string[];
}

async function answered<T>(response: Response): Promise<T> {
  if (!response.ok) throw new Error(((await response.json()) as {error: string}).error);
  return await response.json() as T;
}
const get = async <T>(path: string) => answered<T>(await fetch('/api/v1' + path, {headers: authorization()}));

// The same key when the connection breaks and the order is sent again, so that it is carried out once.
async function post<T>(path: string, body: object): Promise<T> {
  const key = Array.from(crypto.getRandomValues(new Uint8Array(16)), byte => byte.toString(16).padStart(2, '0')).join('');
  const headers = {...authorization(), 'Content-Type': 'application/json', 'Idempotency-Key': key};
  const send = () => fetch('/api/v1' + path, {method: 'POST', headers, body: JSON.stringify(body)});
  return answered<T>(await send().catch(send));
}

export interface JobFilter {
  kind: string;
  state: string;
  text: string;
  after: string;
  limit: number;
}
export type Verb = 'pause' | 'resume' | 'cancel' | 'retry' | 'rerun';
export interface Target {
  kind: 'shots' | 'jobs';
  id: number;
  stage?: string;
}

export const api = {
  session: () => get<Session>('/session'),
  openSession: () => post<Session>('/session', {}),
  health: () => get<Health>('/health'),
  shots: () => get<{shots: Shot[]}>('/shots').then(answer => answer.shots),
  shot: (id: number) => get<ShotDetail>(`/shots/${id}`),
  jobs: (shot: number, filter: Partial<JobFilter>) => {
    const query = new URLSearchParams();
    for (const [key, value] of Object.entries(filter)) if (value !== '') query.set(key, String(value));
    return get<JobPage>(`/shots/${shot}/jobs?${query}`);
  },
  estimate: (id: number) => get<Estimate>(`/shots/${id}/estimate`),
  job: (id: number) => get<JobDetail>(`/jobs/${id}`),
  log: async (id: number) => {
    const response = await fetch(`/api/v1/jobs/${id}/log?tail=65536`, {headers: authorization()});
    return response.ok ? await response.text() : '';
  },
  workers: () => get<{workers: Worker[]}>('/workers').then(answer => answer.workers),
  order: (target: Target, verb: Verb, dryRun: boolean) =>
      post<OrderResult>(`/${target.kind}/${target.id}/${verb}`, {dry_run: dryRun, ...(target.stage && {stage: target.stage})}),
  orderWorker: (id: string, verb: 'drain' | 'undrain' | 'selftest') => post<OrderResult>(`/workers/${encodeURIComponent(id)}/${verb}`, {}),
  preview: (id: number, key: string) => `/api/v1/jobs/${id}/preview?k=${key}`,
  out: (shot: number, path: string) => `/api/v1/shots/${shot}/out/${path}`,
};
