// The banner of a shot and its pipeline: one card per stage.
import {api, type Estimate, type ShotDetail, type Stage, type Target} from './api';
import {el} from './dom';
import {duration} from './format';
import {orderButton} from './orders';
import {bar, countOf, finishedOf, groups, legend, totalOf} from './states';

const failedGroup = groups.find(group => group.name === 'failed')!;
const runningGroup = groups.find(group => group.name === 'running')!;

function headline(shot: ShotDetail): string {
  const total = totalOf(shot.counts);
  const finished = finishedOf(shot.counts);
  const failed = countOf(shot.counts, failedGroup);
  const percent = total ? Math.floor(100 * finished / total) : 0;
  const words = [`${finished} of ${total} jobs`];
  if (shot.state === 'running') words.unshift(`${percent} % of what is planned so far`);
  if (failed) words.push(`${failed} failed`);
  const elapsed = (shot.finished_ms ?? Date.now()) - shot.submitted_ms;
  words.push(shot.state === 'running' ? `running for ${duration(elapsed)}` : `${shot.state} after ${duration(elapsed)}`);
  return words.join(' · ');
}

/// What can be asked of a shot, or of the stage that is selected in it.
function orders(shot: ShotDetail, stage: string): HTMLElement {
  const target: Target = {kind: 'shots', id: shot.id, stage};
  const counts = (shot.stages.find(one => one.kind === stage) ?? shot).counts;
  const open = (counts.ready ?? 0) + (counts.blocked ?? 0) + countOf(counts, runningGroup) > 0;
  const paused = shot.state === 'paused';
  return el('p', {class: 'orders'}, stage ? el('span', {class: 'hint'}, stage + ':') : null,
      countOf(counts, failedGroup) > 0 && orderButton('Retry failed', target, 'retry'),
      open && !paused && orderButton('Pause', target, 'pause'),
      (paused || (counts.paused ?? 0) > 0) && orderButton('Resume', target, 'resume'),
      open && orderButton('Cancel', target, 'cancel'), stage && finishedOf(counts) > 0 && orderButton('Make again', target, 'rerun'));
}

export function estimateLine(estimate: Estimate): string {
  if (!estimate.rest) return '';
  const {low_s, high_s, unknown_kinds} = estimate.rest;
  const more = unknown_kinds.length ? `, and then ${unknown_kinds.join(', ')}` : '';
  return `Will take another ${duration(1000 * low_s)} to ${duration(1000 * high_s)}${more}`;
}

export function banner(shot: ShotDetail, estimate: string, stage: string, mayOperate: boolean): HTMLElement[] {
  const title = el('div', {class: 'title'}, el('h2', {}, shot.name), el('code', {class: 'path'}, shot.folder),
      shot.until && el('span', {class: 'tag'}, 'until ' + shot.until),
      shot.has_report && el('a', {href: api.out(shot.id, 'report.html'), target: '_blank', class: 'button'}, 'Report'));
  const parts = [title, el('p', {class: 'headline'}, headline(shot)), bar(shot.counts)];
  if (estimate) parts.push(el('p', {class: 'hint'}, estimate));
  if (shot.error) parts.push(el('p', {class: 'error', role: 'alert'}, shot.error));
  if (mayOperate) parts.push(orders(shot, stage));
  return parts;
}

function card(stage: Stage, selected: boolean, onSelect: (kind: string) => void): HTMLElement {
  const total = totalOf(stage.counts);
  const finished = finishedOf(stage.counts);
  const busy = countOf(stage.counts, runningGroup) > 0;
  const kind = ['stage', selected ? 'selected' : '', total === 0 ? 'empty' : '', busy ? 'busy' : ''].join(' ');
  return el('button', {class: kind, 'aria-pressed': selected ? 'true' : 'false', title: stage.publishes, onclick: () => onSelect(selected ? '' : stage.kind)},
      el('span', {class: 'name'}, stage.kind),
      el('span', {class: 'figure'}, total ? `${finished}/${total}` : '–'),
      bar(stage.counts),
      total ? legend(stage.counts) : el('span', {class: 'legend'}, 'nothing planned yet'),
      el('span', {class: 'cost'}, stage.wall_ms ? duration(stage.wall_ms) + ' of work' : ''));
}

export const stageCards = (shot: ShotDetail, selected: string, onSelect: (kind: string) => void) =>
    shot.stages.map(stage => card(stage, stage.kind === selected, onSelect));
