"""yaml-language-server (npm) as a child process that speaks the language server protocol over its standard streams.

It is looked for in the environment variable CAMCOMP_YAML_LANGUAGE_SERVER, then on PATH, and is installed by npm otherwise.
"""

import itertools
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

NAME = "yaml-language-server"
PATIENCE_S = 120


def binary(folder):
    """Path of the server; installed into `folder` where it is not there. Skips the test without npm or network."""
    found = os.environ.get("CAMCOMP_YAML_LANGUAGE_SERVER") or shutil.which(NAME)
    if found:
        return found
    if shutil.which("npm") is None:
        pytest.skip("neither yaml-language-server nor npm is installed")
    done = subprocess.run(
        ["npm", "install", "--no-audit", "--no-fund", "--prefix", str(folder), NAME],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    if done.returncode:
        pytest.skip(f"npm cannot install {NAME}: {done.stderr[-200:]}")
    return str(folder / "node_modules/.bin" / NAME)


class LanguageServer:
    """One server and one open document at a time. schema: of all documents."""

    def __init__(self, path, schema):
        self._process = subprocess.Popen([path, "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._ids, self._schema, self._published = itertools.count(1), Path(schema).as_uri(), {}
        self._files = itertools.count(1)
        self._ask("initialize", {"processId": os.getpid(), "rootUri": None, "capabilities": _CAPABILITIES})
        self._tell("initialized", {})
        self._tell("workspace/didChangeConfiguration", {"settings": {"yaml": self._settings()}})

    def close(self):
        """End the process."""
        self._process.kill()
        self._process.communicate()

    def open(self, text, path=None):
        """Open a document, of no file or as the one at `path`; its name for the questions below."""
        uri = path.as_uri() if path else f"file:///machine{next(self._files)}.yaml"
        document = {"uri": uri, "languageId": "yaml", "version": 1, "text": text}
        self._tell("textDocument/didOpen", {"textDocument": document})
        return uri

    def hover(self, uri, line, character):
        """Text shown over a place, lines and characters from 0."""
        found = self._ask("textDocument/hover", _at(uri, line, character))
        return (found or {}).get("contents", {}).get("value", "")

    def offered(self, uri, line, character):
        """Labels of completions at a place."""
        found = self._ask("textDocument/completion", _at(uri, line, character))
        return {each["label"] for each in (found["items"] if isinstance(found, dict) else found)}

    def findings(self, uri):
        """Messages about a document."""
        while uri not in self._published:
            self._read()
        return [each["message"] for each in self._published[uri]]

    def _settings(self):
        return {"schemas": {self._schema: "*.yaml"}, "validate": True, "hover": True, "completion": True}

    def _ask(self, method, params):
        number = next(self._ids)
        self._send({"id": number, "method": method, "params": params})
        while (answer := self._read()).get("id") != number or "method" in answer:
            pass
        assert "error" not in answer, answer
        return answer["result"]

    def _tell(self, method, params):
        self._send({"method": method, "params": params})

    def _send(self, message):
        data = json.dumps({"jsonrpc": "2.0", **message}).encode()
        self._process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(data) + data)
        self._process.stdin.flush()

    def _read(self):
        """The next message; questions of the server are answered, findings kept."""
        length = 0
        while (line := self._process.stdout.readline().strip()) or not length:
            assert line or self._process.poll() is None, "the language server ended"
            if line.lower().startswith(b"content-length:"):
                length = int(line.split(b":")[1])
        message = json.loads(self._process.stdout.read(length))
        if message.get("method") == "textDocument/publishDiagnostics":
            self._published[message["params"]["uri"]] = message["params"]["diagnostics"]
        elif message.get("method") == "workspace/configuration":
            sections = [each.get("section") for each in message["params"]["items"]]
            self._send({"id": message["id"], "result": [self._settings() if s == "yaml" else None for s in sections]})
        elif "method" in message and "id" in message:
            self._send({"id": message["id"], "result": None})
        return message


_CAPABILITIES = {
    "workspace": {"configuration": True, "didChangeConfiguration": {}},
    "textDocument": {"hover": {"contentFormat": ["markdown"]}, "completion": {"completionItem": {}}},
}


def _at(uri, line, character):
    return {"textDocument": {"uri": uri}, "position": {"line": line, "character": character}}
