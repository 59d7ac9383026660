#!/bin/sh
# Codex directs an episode over MCP:
#
#     tandem evaluate --policy exec:gateway/examples/agents/codex.sh --policy-name codex --tasks handover --seeds 0 --out runs/codex
#
# Its standard input is the brief; what it says and calls is in stdout.txt beside the episode. It has a shell of its own that may
# read files, so run it as a user who may not read the folder of --out of other evaluations.
set -eu
exec codex exec --json --skip-git-repo-check --sandbox read-only \
    -c "mcp_servers.tandem.url=\"$TANDEM_URL/mcp\"" -c 'mcp_servers.tandem.bearer_token_env_var="TANDEM_TOKEN"' "$@" -
