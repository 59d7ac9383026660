#!/bin/sh
# Claude Code directs an episode over MCP, with Tandem's tools and no others:
#
#     tandem evaluate --policy exec:gateway/examples/agents/claude.sh --policy-name claude --tasks handover --seeds 0 --out runs/claude
#
# Its standard input is the brief; what it says and calls is in stdout.txt beside the episode. Arguments go to `claude`, as
# exec:"gateway/examples/agents/claude.sh --model opus".
set -eu
server="{\"type\": \"http\", \"url\": \"$TANDEM_URL/mcp\", \"headers\": {\"Authorization\": \"Bearer $TANDEM_TOKEN\"}}"
exec claude --print --verbose --output-format stream-json \
    --tools "" --strict-mcp-config --mcp-config "{\"mcpServers\": {\"tandem\": $server}}" --allowedTools mcp__tandem "$@"
