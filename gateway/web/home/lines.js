// Lines to copy that connect an agent to this server.

/** Name of the shell variable for the server's token. */
const TOKEN = "TANDEM_TOKEN";

/**
 * Returns the ways to connect, each with its lines. `episode` is the id of an episode that this page has started;
 * without it, the lines start one.
 * @param {{ url: string, locked: boolean, task: string, seed: number, episode?: string }} given
 */
export function waysToConnect({ url, locked, task, seed, episode }) {
  const said = episode
    ? `Play the episode ${episode} with the tools of tandem, to its end.`
    : `Start an episode of ${task} with seed ${seed} by the tools of tandem, and play it to its end.`;
  const bearer = { Authorization: `Bearer \${${TOKEN}}` };
  const server = { type: "http", url: `${url}/mcp`, ...(locked ? { headers: bearer } : {}) };
  const header = locked ? ` --header "Authorization: Bearer $${TOKEN}"` : "";
  return [
    {
      name: "Claude Code",
      hint: "Run in a shell; the second line begins to play.",
      text: lines(
        `claude mcp add --transport http tandem ${url}/mcp${header}`,
        `claude ${quoted(said)} --allowedTools mcp__tandem`,
      ),
    },
    {
      name: "Codex",
      hint: "Run in a shell.",
      text: lines(
        `codex -c 'mcp_servers.tandem.url="${url}/mcp"' \\`,
        locked ? `  -c 'mcp_servers.tandem.bearer_token_env_var="${TOKEN}"' \\` : null,
        `  ${quoted(said)}`,
      ),
    },
    {
      name: "Other MCP clients",
      hint: "For the client's configuration; streamable HTTP.",
      text: JSON.stringify({ mcpServers: { tandem: server } }, null, 2),
    },
    {
      name: "REST",
      hint: "Any language; the interface has every route.",
      text: lines(
        `B=${url}; J='content-type: application/json'${locked ? `; T="authorization: Bearer $${TOKEN}"` : ""}`,
        episode ? null : `E=$B/v1/episodes/$(curl -s $B/v1/episodes -H "$J"${locked ? ' -H "$T"' : ""} \\`,
        episode
          ? null
          : `  -d '${JSON.stringify({ task, seed })}' | grep -o '${task}-seed${seed}[-0-9]*' | head -1)`,
        episode ? `E=$B/v1/episodes/${episode}` : null,
        `curl -s $E/tools/observe -H "$J"${locked ? ' -H "$T"' : ""} -d '{"robots": ["A"]}'`,
        `curl -s $E/tools/move_wrists -H "$J"${locked ? ' -H "$T"' : ""} -d '{"steps": 25, "robots":`,
        `  [{"robot": "A", "right_position_m": [0.12, -0.2, 0.18]}]}'`,
      ),
    },
    { name: "Python", hint: "With the package tandem-sim.", text: python({ url, task, seed, episode }) },
    {
      name: "A language model",
      hint: "Any endpoint of OpenAI's or Anthropic's formats.",
      text: lines(`tandem agent --url ${url} \\`, `  --model gpt-6.2-sol --task ${task} --seed ${seed}`),
    },
  ];
}

/** @param {{ url: string, task: string, seed: number, episode?: string }} given */
function python({ url, task, seed, episode }) {
  const begin = ["import tandem", "", `client = tandem.Client("${url}")`];
  if (episode)
    return lines(
      ...begin,
      `tools = "/v1/episodes/${episode}/tools/"`,
      `seen = client.request("POST", tools + "observe", {})`,
      `client.request("POST", tools + "wait", {"steps": 25})`,
    );
  return lines(
    ...begin,
    `with client.episode("${task}", seed=${seed}) as episode:`,
    "    seen = episode.observe()",
    "    episode.wait(25)",
    "    print(episode.finish().phases)",
  );
}

const lines = (/** @type {(string | null)[]} */ ...some) => some.filter((line) => line !== null).join("\n");

/** Quotes a text as one word of a shell. @param {string} text */
const quoted = (text) => `'${text.replaceAll("'", "'\\''")}'`;
