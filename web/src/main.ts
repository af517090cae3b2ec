// The page: what is selected lives in the address (so it can be shared), what is shown comes from the API.
import {api, type JobFilter, type Session, type Shot} from './api';
import {showDrawer} from './drawer';
import {byId, el, show} from './dom';
import {table, tableControls, type TableActions} from './jobs';
import {gallery, pictureKinds, type Pictures} from './pictures';
import {banner, estimateLine, stageCards} from './stages';
import {bar} from './states';
import {hasToken, setToken, takeTokenFromAddress} from './token';
import {workerCards} from './workers';

const picturesPerRow = 12;

interface Selection extends JobFilter {
  shot: number;
  job: number;
}

function fromAddress(): Selection {
  const query = new URLSearchParams(location.hash.slice(1));
  return {shot: Number(query.get('shot') ?? 0), job: Number(query.get('job') ?? 0), kind: query.get('kind') ?? '', state: query.get('state') ?? '',
          text: query.get('text') ?? '', after: query.get('after') ?? '', limit: 50};
}
let selection = fromAddress();

function choose(change: Partial<Selection>) {
  selection = {...selection, ...change};
  const query = new URLSearchParams();
  for (const key of ['shot', 'job', 'kind', 'state', 'text', 'after'] as const) if (selection[key]) query.set(key, String(selection[key]));
  history.replaceState(null, '', '#' + query);
  void refresh();
}
const openJob = (job: number) => choose({job});
const closeJob = () => {
  byId('drawer').hidden = true;
  byId('drawer').replaceChildren();
  choose({job: 0});
};
let trail: string[] = [];  // where the pages before this one begin
const tableActions: TableActions = {
  filter: change => { trail = []; choose(change); },
  turn: after => { trail.push(selection.after); choose({after}); },
  back: () => choose({after: trail.pop() ?? ''}),
  open: openJob,
};

function showShots(shots: Shot[]) {
  show(byId('shots'), [shots, selection.shot], () => shots.map(shot => el('button',
      {class: 'shot' + (shot.id === selection.shot ? ' selected' : ''), title: shot.folder, onclick: () => choose({shot: shot.id, job: 0, after: ''})},
      shot.name, bar(shot.counts))));
}

async function showPictures(shot: number, films: Pictures['films']) {
  const rows = await Promise.all(pictureKinds.map(async kind => {
    const page = await api.jobs(shot, {kind, state: 'done,skipped', limit: picturesPerRow});
    return {kind, jobs: page.jobs.filter(job => job.has_preview)};
  }));
  const pictures = {shot, films, rows};
  show(byId('pictures'), {films, shown: rows.map(row => row.jobs.map(job => [job.id, job.key]))}, () => gallery(pictures, openJob));
}

async function showJobs(shot: number, stages: Parameters<typeof tableControls>[0]) {
  const place = byId('jobs');
  if (!place.firstChild) place.append(el('div', {class: 'controls'}), el('div', {class: 'table'}));
  const controls = place.querySelector('.controls') as HTMLElement;
  show(controls, [stages.map(stage => stage.kind), selection.kind, selection.state], () => tableControls(stages, selection, tableActions));
  const {kind, state, text, after, limit} = selection;
  const page = await api.jobs(shot, {kind, state, text, after, limit});
  show(place.querySelector('.table') as HTMLElement, [page, after], () => table(page, selection, trail.length + 1, tableActions));
}

async function showAll() {
  const [shots, workers, health] = await Promise.all([api.shots(), api.workers(), api.health()]);
  show(byId('health'), health, () => [health.ok ? null : el('p', {role: 'alert'}, health.trouble)]);
  byId('health').hidden = health.ok;
  if (!shots.some(shot => shot.id === selection.shot)) selection.shot = shots[shots.length - 1]?.id ?? 0;
  showShots(shots);
  show(byId('workers'), [session, workers.map(({last_seen_ms, ...rest}) => rest)], () => workerCards(workers, session.role === 'operate', openJob));
  if (!selection.shot) return show(byId('banner'), 0, () => [el('p', {class: 'hint'}, 'No shot yet. vantage submit SHOT --server ' + location.origin)]);
  const shot = await api.shot(selection.shot);
  document.title = `${shot.name} · ${shot.state} · Vantage`;
  const minute = shot.state === 'running' ? Math.floor(Date.now() / 1000) : 0;
  const estimate = shot.state === 'running' ? estimateLine(await api.estimate(shot.id)) : '';
  show(byId('banner'), [shot, minute, session, estimate, selection.kind], () => banner(shot, estimate, selection.kind, session.role === 'operate'));
  show(byId('stages'), [shot.stages, selection.kind], () => stageCards(shot, selection.kind, kind => choose({kind, after: ''})));
  await Promise.all([showJobs(shot.id, shot.stages), showPictures(shot.id, shot.films),
                     selection.job ? showDrawer(selection.job, {open: openJob, close: closeJob, mayOperate: session.role === 'operate'}) : null]);
}

let busy = false;
let again = false;
async function refresh() {
  if (busy) { again = true; return; }
  busy = true;
  try {
    await showAll();
    setLink(true, '');
  } catch (error) {
    setLink(false, error instanceof TypeError ? 'the scheduler does not answer' : String(error));
  }
  busy = false;
  if (again) { again = false; void refresh(); }
}

function setLink(up: boolean, why: string) {
  byId('link').className = 'link ' + (up ? 'up' : 'down');
  byId('link').textContent = up ? 'live' : why;
}

// The server says when its database has changed; the slow beat covers a broken stream and moving clocks.
// #still=1 shows one moment only: for prints and pictures of the page.
function listen() {
  if (new URLSearchParams(location.hash.slice(1)).has('still')) return;
  const events = new EventSource('/api/v1/events');
  events.addEventListener('changed', () => void refresh());
  setInterval(() => void refresh(), 2000);
}

let session: Session = {who: '', role: 'read'};

/// Who looks; pictures, films and the event stream then go by a cookie.
async function signIn() {
  try {
    session = await (hasToken() ? api.openSession() : api.session());
    showSession('');
  } catch (error) {
    session = {who: '', role: 'read'};
    showSession(error instanceof Error ? error.message : String(error));
  }
}

function showSession(trouble: string) {
  const mayOperate = session.role === 'operate';
  show(byId('session'), [session, trouble], () => [
    mayOperate ? el('span', {class: 'hint'}, session.who) :
                 el('button', {class: 'quiet', title: 'Read only. The address that vantage prints carries a token; or paste one here.', onclick: askToken},
                    trouble ? 'Token…' : 'Read only'),
  ]);
}

function askToken() {
  const token = prompt('Token (the scheduler\'s state folder holds one in operator.token):');
  if (token === null) return;
  setToken(token.trim());
  void signIn().then(refresh);
}

async function start() {
  takeTokenFromAddress();
  selection = fromAddress();
  await signIn();
  await refresh();
  listen();
}

function setTheme(theme: string) {
  document.documentElement.dataset.theme = theme;
  localStorage.setItem('theme', theme);
}

byId('theme').addEventListener('click', () => setTheme(document.documentElement.dataset.theme === 'light' ? 'dark' : 'light'));
setTheme(localStorage.getItem('theme') ?? (matchMedia('(prefers-color-scheme: light)').matches ? 'light' : 'dark'));
addEventListener('hashchange', () => { takeTokenFromAddress(); selection = fromAddress(); void refresh(); });
addEventListener('keydown', event => {
  if (event.key === 'Escape') closeJob();
  if (event.key === '/' && !(event.target instanceof HTMLInputElement)) { event.preventDefault(); byId('find').focus(); }
});
void start();
