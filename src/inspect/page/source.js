// Where frames and answers come from: the server, or the case that is saved in this file.

const TYPES = { f32: Float32Array, u32: Uint32Array, u16: Uint16Array, u8: Uint8Array };

// The header of a binary reply with its arrays beside it; arrays that are left out are those that
// were there before.
export function unpack(buffer, before) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const arrays = {},
    sums = {};
  for (const { name, type, at, length: count, sum } of header.arrays) {
    arrays[name] =
      at === null ? before.arrays[name] : new TYPES[type](buffer, 4 + length + at, count);
    sums[name] = sum;
  }
  return { cloud: header.cloud, run: header.run, arrays, sums };
}

class Served {
  isSaved = false;

  async ask(name, body) {
    let response;
    try {
      response = await fetch(`./api/${name}`, { method: "POST", body: JSON.stringify(body ?? {}) });
    } catch {
      throw new Error("the inspector has ended: start it again and reload this page");
    }
    if (!response.ok) {
      const { problem } = await response.json().catch(() => ({ problem: response.statusText }));
      throw Object.assign(new Error(problem), { status: response.status });
    }
    return response;
  }
  json = async (name, body) => (await this.ask(name, body)).json();
  session = () => this.json("session");
  frame = async (asked, before) =>
    unpack(
      await (await this.ask("frame", { ...asked, known: before?.sums ?? {} })).arrayBuffer(),
      before,
    );
  scores = (asked) => this.json("scores", asked);
  compare = (asked) => this.json("compare", asked);
  explain = (asked) => this.json("explain", asked);
  changes = (asked) => this.json("changes", asked);
  command = (asked) => this.json("command", asked);
  survey = (asked) => this.json("survey", asked);
  surveyState = () => this.json("survey-state");
  stopSurvey = () => this.json("survey-stop");
  tracks = (asked) => this.json("tracks", asked);
  file = async (name, asked) => (await this.ask(name, asked)).blob();
}

const same = (a, b) => canonical(a) === canonical(b);
const canonical = ({ preset, method, set }) =>
  JSON.stringify([preset ?? null, method ?? null, Object.entries(set ?? {}).sort()]);

// Only what was asked before it was saved can be answered.
class Saved {
  isSaved = true;
  constructor(saved) {
    this.saved = saved;
    this.first = null;
  }
  missing = () =>
    Promise.reject(new Error("a saved case holds only what was run before it was saved"));
  session = async () => this.saved.session;

  static async bytes(text) {
    const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
    return new Response(stream).arrayBuffer();
  }
  alternative = (setting) => this.saved.alternatives.find((one) => same(one.setting, setting));

  async frame({ setting, with_points }) {
    this.first ??= unpack(await Saved.bytes(this.saved.picture));
    if (same(setting, this.saved.setting)) return this.first;
    const other = this.alternative(setting);
    if (!other) return this.missing();
    other.unpacked ??= unpack(await Saved.bytes(other.picture), this.first);
    if (!with_points) return other.unpacked;
    return {
      ...other.unpacked,
      cloud: this.first.cloud,
      arrays: { ...this.first.arrays, ...other.unpacked.arrays },
    };
  }
  async scores({ setting }) {
    return same(setting, this.saved.setting)
      ? this.saved.scores
      : (this.alternative(setting)?.scores ?? null);
  }
  async compare({ first, second }) {
    if (same(first, this.saved.setting) && this.alternative(second))
      return this.alternative(second).compared;
    return this.missing();
  }
  async explain({ points, setting }) {
    const { explanation, shown } = this.saved;
    const isIt =
      explanation &&
      same(setting, this.saved.setting) &&
      JSON.stringify(points) === JSON.stringify(shown.points);
    return isIt ? explanation : this.missing();
  }
  changes = (asked) => this.explain(asked);
  command = this.missing;
  survey = this.missing;
  stopSurvey = this.missing;
  surveyState = async () => ({ number: 0, cases: [], is_over: true, done: 0, of: 0 });
  tracks = this.missing;
  file = this.missing;
}

const saved = JSON.parse(document.getElementById("case").textContent);
export const source = saved ? new Saved(saved) : new Served();
export const savedCase = saved;
