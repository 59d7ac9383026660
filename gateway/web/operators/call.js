// Requests as an operator, or as whoever starts episodes. Tokens go in a header: addresses are written to logs.

/** A refusal, in the server's words. */
export class Refused extends Error {
  /** @param {number} status @param {string} detail */
  constructor(status, detail) {
    super(detail);
    this.status = status;
  }
}

/** Answers a request's JSON; without a body it is a GET. */
export async function call(path, token, body, options = { credentials: "omit" }) {
  const headers = token ? { authorization: `Bearer ${token}` } : {};
  if (body) headers["content-type"] = "application/json";
  const sent = body ? { method: "POST", body: JSON.stringify(body) } : {};
  const answer = await fetch(path, { ...sent, ...options, headers });
  const said = await answer.json().catch(() => ({}));
  if (answer.ok) return said;
  throw new Refused(answer.status, said.detail ?? `the server answers ${answer.status}`);
}
