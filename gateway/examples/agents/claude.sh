#!/bin/sh
# Claude Code directs an episode over MCP, with Tandem's tools and no others:
#
#     tandem evaluate --policy exec:gateway/examples/agents/claude.sh --policy-name claude --tasks handover --seeds 0 --out runs/claude
#
# Its standard input is the brief; what it says and calls is in stdout.txt beside the episode. Arguments go to `claude`, as
# exec:"gateway/examples/agents/claude.sh --model opus".
#
# Everybody on the machine can read a command line, so the token is in a file that only its owner can read, and that goes afterwards.
set -eu
umask 077
private=$(mktemp -d)
trap 'rm -rf "$private"' EXIT
trap 'exit 143' HUP INT TERM
cat > "$private/mcp.json" <<CONFIG
{"mcpServers": {"tandem":
    {"type": "http", "url": "$TANDEM_URL/mcp", "headers": {"Authorization": "Bearer $TANDEM_TOKEN"}}}}
CONFIG
claude --print --verbose --output-format stream-json \
    --tools "" --strict-mcp-config --mcp-config "$private/mcp.json" --allowedTools mcp__tandem "$@"
