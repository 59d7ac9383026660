// Requests by operators, and by people who start episodes. Tokens are sent in a header, because addresses are written to logs.

/** A refusal, with the server's text. */
export class Refused extends Error {
  /** @param {number} status @param {string} detail */
  constructor(status, detail) {
    super(detail);
    this.status = status;
  }
}

/** Returns the status of a refusal; null for any other error. @param {unknown} error */
export const statusOf = (error) => (error instanceof Refused ? error.status : null);

/**
 * Returns the headers that carry a token; none without one.
 * @param {string | null} token
 * @returns {Record<string, string>}
 */
export const bearer = (token) => (token ? { authorization: `Bearer ${token}` } : {});

/**
 * Sends a request, and returns the JSON of its answer; without a body it is a GET.
 * @param {string} path
 * @param {string | null} token
 * @param {unknown} [body]
 * @param {RequestInit} [options]
 * @throws {Refused} with the server's text
 */
export async function call(path, token, body, options = { credentials: "omit" }) {
  const headers = bearer(token);
  if (body) headers["content-type"] = "application/json";
  const sent = body ? { method: "POST", body: JSON.stringify(body) } : {};
  const answer = await fetch(path, { ...sent, ...options, headers });
  const said = await answer.json().catch(() => ({}));
  if (answer.ok) return said;
  throw new Refused(answer.status, said.detail ?? `the server answers ${answer.status}`);
}
