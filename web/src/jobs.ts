// The table of jobs: filters and paging are the server's work, so a million jobs cost no more than fifty.
import type {Job, JobFilter, JobPage, Stage} from './api';
import {el} from './dom';
import {duration, gigabytes} from './format';
import {chip, groups} from './states';

export interface TableActions {
  filter: (change: Partial<JobFilter>) => void;
  open: (id: number) => void;
}

function select(label: string, value: string, options: [string, string][], onChange: (value: string) => void): HTMLElement {
  const items = options.map(([key, text]) => el('option', {value: key, selected: key === value}, text));
  return el('select', {'aria-label': label, onchange: event => onChange((event.target as HTMLSelectElement).value)}, ...items);
}

export function tableControls(stages: Stage[], filter: JobFilter, act: TableActions): HTMLElement[] {
  const kinds: [string, string][] = [['', 'all stages'], ...stages.map((stage): [string, string] => [stage.kind, stage.kind])];
  const states: [string, string][] = [['', 'all states'], ...groups.map((group): [string, string] => [group.states.join(','), group.name])];
  return [
    el('h3', {}, 'Jobs'),
    select('Stage', filter.kind, kinds, kind => act.filter({kind, offset: 0})),
    select('State', filter.state, states, state => act.filter({state, offset: 0})),
    el('input', {id: 'find', type: 'search', placeholder: 'name contains…   ( / )', 'aria-label': 'Name contains', value: filter.text,
                 oninput: event => act.filter({text: (event.target as HTMLInputElement).value, offset: 0})}),
  ];
}

function note(job: Job): string {
  if (job.error) return job.error;
  if (job.state === 'running' || job.state === 'leased') return job.phase;
  return job.reason;
}

function row(job: Job, act: TableActions): HTMLElement {
  const progress = job.state === 'running' && el('progress', {value: job.progress, max: 1, 'aria-label': 'progress'});
  return el('tr', {class: job.error ? 'bad' : '', tabindex: 0, onclick: () => act.open(job.id),
                   onkeydown: event => { if ((event as KeyboardEvent).key === 'Enter') act.open(job.id); }},
      el('td', {}, chip(job.state)),
      el('td', {class: 'mono'}, job.name),
      el('td', {class: 'note'}, progress || null, note(job)),
      el('td', {class: 'number'}, job.wall_ms ? duration(job.wall_ms) : ''),
      el('td', {class: 'number'}, job.peak_rss_mb ? gigabytes(job.peak_rss_mb) : ''),
      el('td', {class: 'number'}, job.num_attempts > 1 ? String(job.num_attempts) : ''));
}

export function table(page: JobPage, filter: JobFilter, act: TableActions): HTMLElement[] {
  if (page.total === 0) return [el('p', {class: 'hint'}, 'No job matches.')];
  const head = el('tr', {}, ...['State', 'Job', 'What and why', 'Took', 'Memory', 'Attempts'].map((text, column) =>
      el('th', {class: column > 2 ? 'number' : ''}, text)));
  const last = Math.min(filter.offset + filter.limit, page.total);
  const turn = (offset: number, text: string, possible: boolean) =>
      el('button', {class: 'quiet', disabled: !possible, onclick: () => act.filter({offset})}, text);
  return [
    el('table', {}, el('thead', {}, head), el('tbody', {}, ...page.jobs.map(job => row(job, act)))),
    el('div', {class: 'pager'}, turn(Math.max(0, filter.offset - filter.limit), '‹ earlier', filter.offset > 0),
       el('span', {}, `${filter.offset + 1}–${last} of ${page.total}`), turn(last, 'later ›', last < page.total)),
  ];
}
