// One job, all about it: state and reason, attempts, figures, picture, log, inputs, how to run it by hand.
import {api, type Attempt, type JobDetail, type Target} from './api';
import {byId, el, show} from './dom';
import {bytes, clockTime, duration, figure, gigabytes} from './format';
import {orderButton} from './orders';
import {chip} from './states';

export interface DrawerActions {
  open: (id: number) => void;
  close: () => void;
  mayOperate: boolean;
}

const section = (title: string, ...content: (HTMLElement | null | false)[]) => el('section', {}, el('h4', {}, title), ...content);

function facts(pairs: [string, string][]): HTMLElement {
  return el('dl', {}, ...pairs.flatMap(([name, value]) => [el('dt', {}, name), el('dd', {}, value)]));
}

function attemptRow(attempt: Attempt): HTMLElement {
  const end = attempt.outcome || attempt.state;
  const how = attempt.signal ? `signal ${attempt.signal}` : attempt.exit_code ? `exit ${attempt.exit_code}` : '';
  return el('tr', {class: attempt.error ? 'bad' : ''}, el('td', {}, '#' + attempt.number), el('td', {}, end + (how && ` (${how})`)),
      el('td', {class: 'mono'}, attempt.worker), el('td', {}, clockTime(attempt.leased_ms)),
      el('td', {class: 'number'}, attempt.wall_ms ? duration(attempt.wall_ms) : ''),
      el('td', {class: 'number'}, attempt.peak_rss_mb ? gigabytes(attempt.peak_rss_mb) : ''));
}

function content(job: JobDetail, act: DrawerActions): HTMLElement[] {
  const {warnings, ...figures} = job.figures;
  const target: Target = {kind: 'jobs', id: job.id};
  const bad = ['failed', 'quarantined', 'canceled', 'aborted'].includes(job.state);
  const finished = ['done', 'skipped'].includes(job.state);
  const orders = act.mayOperate && [bad && orderButton('Retry', target, 'retry'), finished && orderButton('Make again', target, 'rerun'),
      !bad && !finished && orderButton('Cancel', target, 'cancel')];
  const parts = [
    el('div', {class: 'title'}, el('h3', {class: 'mono'}, job.name), el('button', {class: 'quiet', title: 'Close (Esc)', onclick: act.close}, '✕')),
    el('p', {}, chip(job.state), job.state === 'running' && ` ${Math.round(100 * job.progress)} % ${job.phase}`, ...(orders || [])),
    job.reason ? el('p', {class: 'reason'}, job.reason) : null,
    job.error ? el('p', {class: 'error', role: 'alert'}, `${job.error_kind}: ${job.error}`) : null,
    ...((warnings ?? []) as string[]).map(text => el('p', {class: 'warning'}, text)),
    job.has_preview ? el('img', {class: 'preview', src: api.preview(job.id, job.key), alt: 'Preview of ' + job.name}) : null,
    Object.keys(figures).length ? section('Figures', facts(Object.entries(figures).map(([name, value]) => [name, figure(value)]))) : null,
    job.attempts.length ? section('Attempts', el('table', {}, el('tbody', {}, ...job.attempts.map(attemptRow)))) : null,
    job.inputs.length ? section('Reads', el('div', {class: 'inputs'}, ...job.inputs.map(input =>
        el('button', {class: 'quiet mono', onclick: () => act.open(input.id)}, chip(input.state), input.name)))) : null,
    job.files.length ? section('Files', facts(job.files.slice(0, 12).map(file => [file.path, bytes(file.size)])),
        job.files.length > 12 && el('p', {class: 'hint'}, `and ${job.files.length - 12} more`)) : null,
    job.history.length ? section('History', facts(job.history.map(event => [clockTime(event.at_ms), event.text]))) : null,
    section('Settings', facts([['cores, memory', `${job.cores}, ${gigabytes(job.ram_mb)}`], ['unit', JSON.stringify(job.unit)],
        ['params', JSON.stringify(job.params)], ['key', job.key || 'not known until its inputs are']])),
    job.reproduce ? section('Run it by hand', el('pre', {class: 'command'}, job.reproduce)) : null,
  ];
  return parts.filter((part): part is HTMLElement => part !== null);
}

export async function showDrawer(id: number, act: DrawerActions) {
  const drawer = byId('drawer');
  const [job, log] = await Promise.all([api.job(id), api.log(id)]);
  if (!drawer.querySelector('.about')) drawer.replaceChildren(el('div', {class: 'about'}), el('h4', {}, 'Log'), el('pre', {class: 'log', tabindex: 0}));
  show(drawer.querySelector('.about') as HTMLElement, job, () => content(job, act));
  const pre = drawer.querySelector('.log') as HTMLElement;
  const follows = pre.scrollTop + pre.clientHeight >= pre.scrollHeight - 8;
  if (pre.textContent !== (log || 'Nothing logged yet.')) pre.textContent = log || 'Nothing logged yet.';
  if (follows) pre.scrollTop = pre.scrollHeight;
  drawer.hidden = false;
}
