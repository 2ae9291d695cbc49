"""Recordings at addresses: a real S3 server and web servers, good and bad ones, on this machine.

Needs the release binary with the feature (`cargo build --release --features remote`), and
`pip install -r tests/python/requirements.txt 'moto[s3,server]' boto3`.
"""

import base64
import contextlib
import datetime
import http.server
import ipaddress
import json
import os
import re
import signal
import ssl
import subprocess
import threading
import urllib.parse

import pytest

from needed import needed, skip_or_fail
from test_independent_readers import BINARY

boto3 = needed("boto3")
needed("moto")

from moto.core.responses import ActionAuthenticatorMixin  # noqa: E402
from moto.moto_server.werkzeug_app import DomainDispatcherApplication, create_backend_app  # noqa: E402
from werkzeug.serving import make_server  # noqa: E402

BUCKET, KEY = "drives", "a/drive.mcap"
SECRET = "never-to-be-seen"
# What a machine may have that runs this.
OTHERS = ("AWS_", "GOOGLE_", "AZURE_", "HTTP_", "HTTPS_", "NO_PROXY", "ALL_PROXY")


def environment(**more):
    own = {name: value for name, value in os.environ.items() if not name.upper().startswith(OTHERS)}
    return {**own, **more}


def start(*arguments, **more):
    return subprocess.run([BINARY, *map(str, arguments)], capture_output=True, text=True, env=environment(**more))


def run(*arguments, code=0, **more):
    done = start(*arguments, **more)
    assert done.returncode == code, done.stderr
    return done.stdout


def refused(*arguments, **more):
    """The one line that is said of what cannot be done."""
    done = start(*arguments, **more)
    assert done.returncode == 1, (done.returncode, done.stderr)
    lines = done.stderr.splitlines()
    assert len(lines) == 1 and lines[0].startswith("error: "), done.stderr
    return lines[0].removeprefix("error: ")


@pytest.fixture(scope="module", autouse=True)
def built():
    if "built without object stores" in start("info", "s3://bucket/key").stderr:
        skip_or_fail("the binary was built without the feature remote")


@pytest.fixture(scope="module")
def drive(tmp_path_factory):
    """A recording of some 40 MB, in chunks of about 4."""
    path = tmp_path_factory.mktemp("remote") / "drive.mcap"
    run("simulate", "--sensor", "hdl-64e", "--frames", 18, "--seed", 7, "-o", path)
    assert path.stat().st_size > 35_000_000
    return path


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    path = tmp_path_factory.mktemp("remote") / "small.mcap"
    run("simulate", "--sensor", "vlp-16", "--frames", 4, "--seed", 7, "-o", path)
    return path


class Seen:
    """What a server was asked, and what is to happen then."""

    def __init__(self):
        self.lock = threading.Lock()
        self.clear()

    def clear(self):
        self.requests, self.before = [], {}

    def note(self, request):
        with self.lock:
            self.requests.append(request)
            happens = self.before.get(len(self.requests))
        if happens:
            happens()
        return request

    @property
    def bytes(self):
        return sum(request["bytes"] for request in self.requests)


class Store:
    """moto's S3 server, with somebody who counts before it."""

    def __init__(self):
        self.seen = Seen()
        self.moto = DomainDispatcherApplication(create_backend_app)
        self.server = make_server("127.0.0.1", 0, self.answer, threaded=True)
        threading.Thread(target=self.server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self.server.server_port}"

    def answer(self, environ, start_response):
        if environ["REQUEST_METHOD"] != "GET" or environ["PATH_INFO"].startswith("/moto-api"):
            return self.moto(environ, start_response)
        request = self.seen.note({
            "range": environ.get("HTTP_RANGE"),
            "if_match": environ.get("HTTP_IF_MATCH"),
            "authorization": environ.get("HTTP_AUTHORIZATION"),
            "query": environ.get("QUERY_STRING"),
            "bytes": 0,
        })

        def started(status, headers, *rest):
            if status.startswith("206"):
                request["bytes"] = int(dict((k.lower(), v) for k, v in headers)["content-length"])
            return start_response(status, headers, *rest)

        return self.moto(environ, started)

    def client(self, service="s3", key="test", secret="test"):
        return boto3.client(service, endpoint_url=self.url, region_name="us-east-1",
                            aws_access_key_id=key, aws_secret_access_key=secret)

    def environment(self, **more):
        return {"AWS_ENDPOINT_URL": self.url, "AWS_ALLOW_HTTP": "true", "AWS_REGION": "us-east-1",
                "AWS_ACCESS_KEY_ID": "test", "AWS_SECRET_ACCESS_KEY": "test", **more}


@pytest.fixture(scope="module")
def s3(drive, small):
    store = Store()
    client = store.client()
    client.create_bucket(Bucket=BUCKET)
    client.upload_file(str(drive), BUCKET, KEY)
    client.upload_file(str(small), BUCKET, "small.mcap")
    yield store
    store.server.shutdown()


@pytest.fixture(autouse=True)
def forgotten(request):
    if "s3" in request.fixturenames:
        request.getfixturevalue("s3").seen.clear()


class Web(http.server.ThreadingHTTPServer):
    """A web server with one file, which can be told to be bad."""

    daemon_threads = True

    def __init__(self, content, ranges="all", tag='"one"', compares=True, needs=None, query=""):
        super().__init__(("127.0.0.1", 0), Answer)
        self.content, self.ranges, self.tag, self.compares = content, ranges, tag, compares
        self.needs, self.query, self.moved_to, self.date = needs or {}, query, None, None
        self.cut, self.failing, self.seen = set(), set(), Seen()

    @property
    def address(self):
        return f"http://127.0.0.1:{self.server_port}/some/drive.mcap"


class Answer(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def refuse(self, status):
        self.send_response(status)
        self.send_header("Content-Length", "0")
        self.end_headers()

    def do_GET(self):
        web = self.server
        path, _, query = self.path.partition("?")
        asked = self.headers.get("Range")
        request = web.seen.note({"range": asked, "path": path, "query": query, "bytes": 0,
                                 "if_match": self.headers.get("If-Match")})
        number = len(web.seen.requests)
        if query != web.query or any(self.headers.get(name) != value for name, value in web.needs.items()):
            return self.refuse(403)
        if web.moved_to:
            self.send_response(302)
            self.send_header("Location", web.moved_to)
            self.send_header("Content-Length", "0")
            return self.end_headers()
        if number in web.failing:
            return self.refuse(503)
        if web.compares and request["if_match"] not in (None, web.tag):
            return self.refuse(412)
        content, size = web.content, len(web.content)
        first, last = re.fullmatch(r"bytes=(\d*)-(\d*)", asked).groups()
        gives_part = web.ranges == "all" or web.ranges == "no suffix" and first
        if not gives_part:
            first, last, status = 0, size - 1, 200
        elif first == "":
            first, last, status = max(0, size - int(last)), size - 1, 206
        else:
            first, last, status = int(first), min(int(last), size - 1), 206
        if status == 206 and first >= size:
            return self.refuse(416)
        part = content[first:last + 1]
        self.send_response(status)
        self.send_header("Content-Length", str(len(part)))
        if status == 206:
            self.send_header("Content-Range", f"bytes {first}-{last}/{size}")
        if web.date:
            self.send_header("Last-Modified", web.date)
        if web.tag:
            self.send_header("ETag", web.tag)
        self.end_headers()
        request["bytes"] = len(part)
        with contextlib.suppress(OSError):
            if number in web.cut:
                self.wfile.write(part[:len(part) // 2])
                self.close_connection = True
            else:
                self.wfile.write(part)


@pytest.fixture
def web():
    servers = []

    def served(content, **how):
        server = Web(content, **how)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        servers.append(server)
        return server

    yield served
    for server in servers:
        server.shutdown()
        server.server_close()


def annotated(source, folder, *more, code=0, **how):
    """The report of an annotation, and the bytes of the output."""
    output = folder / "annotated.mcap"
    report = json.loads(run("annotate", source, "-o", output, "--force", "--json", *more, code=code, **how))
    return report, output.read_bytes()


def address(key=KEY):
    return f"s3://{BUCKET}/{key}"


def test_the_output_of_an_object_is_that_of_the_file(s3, drive, tmp_path):
    report, found = annotated(address(), tmp_path, **s3.environment())
    expected_report, expected = annotated(drive, tmp_path)
    assert found == expected
    assert report["input_sha256"] == expected_report["input_sha256"] is not None
    assert report["input_bytes_read"] == expected_report["input_bytes_read"]
    assert "fetched" not in expected_report
    # Every byte once, in pieces of 8 MiB once it is under way.
    size = drive.stat().st_size
    assert report["fetched"] == {"requests": len(s3.seen.requests), "bytes": size}
    assert s3.seen.bytes == size
    assert len(s3.seen.requests) <= 5 + size // (8 << 20)
    first, *rest = s3.seen.requests
    assert first["range"] == f"bytes=-{256 << 10}" and first["if_match"] is None
    assert {request["if_match"] for request in rest} == {s3.client().head_object(Bucket=BUCKET, Key=KEY)["ETag"]}


def test_a_slice_costs_a_slice(s3, drive, tmp_path):
    window = ["--from", "frame:9", "--to", "frame:11"]
    report, found = annotated(address(), tmp_path, *window, **s3.environment())
    expected_report, expected = annotated(drive, tmp_path, *window)
    assert found == expected
    size = drive.stat().st_size
    assert report["input_bytes_read"] == expected_report["input_bytes_read"]
    assert report["fetched"]["bytes"] == s3.seen.bytes < size * 2 // 5
    assert report["fetched"]["requests"] == len(s3.seen.requests) <= 5


def test_a_look_costs_little(s3, drive, tmp_path):
    size = drive.stat().st_size
    told = json.loads(run("info", address(), "--json", **s3.environment()))
    expected = json.loads(run("info", drive, "--json"))
    assert {**told, "file": None} == {**expected, "file": None}
    assert told["file"] == address()
    # The end, the start, and what the first cloud lies in.
    assert len(s3.seen.requests) <= 4 and s3.seen.bytes < size // 5

    s3.seen.clear()
    pictures = [tmp_path / "remote.png", tmp_path / "local.png"]
    run("figure", address(), "--frame", 12, "-o", pictures[0], **s3.environment())
    assert len(s3.seen.requests) == 3 and s3.seen.bytes < size // 5
    run("figure", drive, "--frame", 12, "-o", pictures[1])
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


COMMANDS = {
    "info": ["info", "IN"],
    "explain": ["explain", "IN", "--frame", "1", "--instance", "1", "--instance", "2"],
    "triage": ["triage", "IN", "--frames", "..2"],
    "evaluate": ["evaluate", "IN"],
    "failures": ["failures", "IN", "--frames", "..2"],
    "diff": ["diff", "IN", "IN"],
    "export": ["export", "IN", "--topic", "/lidar/points", "--class-field", "label", "--labels", "OUT",
               "--instance-field", "true_instance", "--force"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_commands_take_addresses(s3, small, tmp_path, name):
    def said(source, **more):
        words = {"IN": source, "OUT": tmp_path / "out"}
        done = start(*[words.get(word, word) for word in COMMANDS[name]], **more)
        assert "Traceback" not in done.stderr and "panicked" not in done.stderr
        text = (done.stdout + done.stderr).replace(str(source), "IN")
        return done.returncode, re.sub(r"[\d.,]+ (ms|s)\b|[\d.]+ (clouds|frames) per second", "TIME", text)

    found = said(address("small.mcap"), **s3.environment())
    assert found == said(small)
    assert found[0] in (0, 1) and s3.seen.requests


def test_files_and_addresses_into_a_folder(s3, drive, small, tmp_path, web):
    served = web(small.read_bytes())
    copy = tmp_path / "copy.mcap"
    copy.write_bytes(small.read_bytes())
    inputs = [copy, address("small.mcap"), served.address]
    run("annotate", *inputs, "-o", tmp_path / "out", **s3.environment())
    made = {path.name for path in (tmp_path / "out").glob("*.mcap")}
    assert made == {"copy.mcap", "small.mcap", "drive.mcap"}
    # An output that is a folder gets the object's name, without the query.
    served.query = f"token={SECRET}/x"
    (tmp_path / "alone").mkdir()
    run("annotate", f"{served.address}?{served.query}", "-o", tmp_path / "alone")
    assert (tmp_path / "alone" / "drive.mcap").is_file()


def test_without_an_index_it_is_read_through(s3, drive, tmp_path):
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(drive.read_bytes()[:20_000_000])
    s3.client().upload_file(str(cut), BUCKET, "cut.mcap")
    s3.seen.clear()
    report, found = annotated(address("cut.mcap"), tmp_path, code=3, **s3.environment())
    _, expected = annotated(cut, tmp_path, code=3)
    assert found == expected
    # Once for what is in it, which is then known, and once to annotate it.
    assert report["fetched"]["bytes"] <= 2 * cut.stat().st_size


def test_slices_cost_their_part(s3, drive, tmp_path):
    plan, parts, output = tmp_path / "plan.json", tmp_path / "parts", tmp_path / "annotated.mcap"
    run("plan", address(), "--shards", 3, "-o", plan, **s3.environment())
    # The end and the start: what is in it, and where.
    assert len(s3.seen.requests) <= 2
    size = drive.stat().st_size
    for number in range(3):
        s3.seen.clear()
        run("annotate", "--slice", f"{plan}:{number}", "-o", parts, **s3.environment())
        assert s3.seen.bytes < size * 3 // 5
    run("join", parts, "--plan", plan, "-o", output, **s3.environment())
    _, expected = annotated(drive, tmp_path / "parts")
    assert output.read_bytes() == expected


def test_what_is_not_there_is_named(s3):
    def said(source, **more):
        return refused("info", source, **s3.environment(**more))

    assert said(address("nothing.mcap")) == f"{address('nothing.mcap')}: not found (NoSuchKey)"
    assert said("s3://nowhere/a.mcap") == "s3://nowhere/a.mcap: not found (NoSuchBucket)"
    assert "names no object" in said("s3://drives")
    assert "an address of an unknown kind" in said("ftp://host/a.mcap")
    assert "Connection refused" in said(address(), AWS_ENDPOINT_URL="http://127.0.0.1:9")
    assert "Connection refused" in refused("info", "https://127.0.0.1:9/a.mcap")
    assert "AWS_ALLOW_HTTP=true" in said(address(), AWS_ALLOW_HTTP="false")
    assert "set AWS_ACCESS_KEY_ID" in refused("info", address(), AWS_ACCESS_KEY_ID="alone")
    nobody = refused("info", address(), AWS_METADATA_ENDPOINT="http://127.0.0.1:9")
    assert "no credentials" in nobody and "AWS_SKIP_SIGNATURE=true" in nobody
    assert "AZURE_STORAGE_ACCOUNT_NAME" in refused("info", "az://container/a.mcap")


def test_an_empty_object(s3):
    s3.client().put_object(Bucket=BUCKET, Key="empty.mcap", Body=b"")
    assert "the object is empty" in refused("info", address("empty.mcap"), **s3.environment())


def test_what_is_no_recording(s3):
    s3.client().put_object(Bucket=BUCKET, Key="text.mcap", Body=b"hello, this is text")
    assert "not an MCAP" in refused("info", address("text.mcap"), **s3.environment())


@pytest.fixture
def strict(s3):
    """Keys of somebody that the server lets in; from here on it lets nobody else in."""
    iam = s3.client("iam")
    iam.create_user(UserName="somebody")
    policy = {"Version": "2012-10-17", "Statement": [{"Effect": "Allow", "Action": "s3:*", "Resource": "*"}]}
    iam.put_user_policy(UserName="somebody", PolicyName="all", PolicyDocument=json.dumps(policy))
    keys = iam.create_access_key(UserName="somebody")["AccessKey"]
    before = ActionAuthenticatorMixin.request_count
    import moto.core.responses as responses
    limit = responses.settings.INITIAL_NO_AUTH_ACTION_COUNT
    responses.settings.INITIAL_NO_AUTH_ACTION_COUNT = 0
    ActionAuthenticatorMixin.request_count = 0
    yield {"AWS_ACCESS_KEY_ID": keys["AccessKeyId"], "AWS_SECRET_ACCESS_KEY": keys["SecretAccessKey"]}
    responses.settings.INITIAL_NO_AUTH_ACTION_COUNT = limit
    ActionAuthenticatorMixin.request_count = before


def test_wrong_credentials_are_denied(s3, strict):
    run("info", address(), **s3.environment(**strict))

    def said(**more):
        return refused("info", address(), **s3.environment(**{**strict, **more}))

    wrong = said(AWS_SECRET_ACCESS_KEY=SECRET)
    assert "access denied (SignatureDoesNotMatch)" in wrong and SECRET not in wrong
    assert "access denied (InvalidAccessKeyId)" in said(AWS_ACCESS_KEY_ID="nobody")


def test_without_a_signature_where_that_is_asked_for(s3, small):
    s3.client().put_object_acl(Bucket=BUCKET, Key="small.mcap", ACL="public-read")
    more = s3.environment(AWS_SKIP_SIGNATURE="true")
    del more["AWS_ACCESS_KEY_ID"], more["AWS_SECRET_ACCESS_KEY"]
    run("info", address("small.mcap"), **more)
    assert [request["authorization"] for request in s3.seen.requests] == [None] * len(s3.seen.requests)


@pytest.mark.parametrize("request_number", [3, 6])
def test_an_object_that_changes_is_refused(s3, drive, tmp_path, request_number):
    s3.client().upload_file(str(drive), BUCKET, "changes.mcap")
    s3.seen.clear()
    other = drive.read_bytes()[::-1]
    s3.seen.before[request_number] = lambda: s3.client().put_object(Bucket=BUCKET, Key="changes.mcap", Body=other)
    output = tmp_path / "out.mcap"
    said = refused("annotate", address("changes.mcap"), "-o", output, **s3.environment())
    assert said == f"{address('changes.mcap')}: the object changed while it was read"
    assert not output.exists()


def test_addresses_that_are_secrets_go_to_the_server_alone(s3, drive, tmp_path):
    url = s3.client(key="AKNEVERSHOWN").generate_presigned_url(
        "get_object", Params={"Bucket": BUCKET, "Key": KEY, "ResponseContentLanguage": SECRET})
    secrets = re.findall(r"(?:Signature|AWSAccessKeyId|Expires)=([^&]*)", url.split("?")[1]) + [SECRET]
    assert len(secrets) > 2
    output = tmp_path / "out.mcap"
    report, found = annotated(url, tmp_path, "--from", "frame:2", "--to", "frame:3")
    _, expected = annotated(drive, tmp_path, "--from", "frame:2", "--to", "frame:3")
    assert found == expected
    assert report["input"] == f"{s3.url}/{BUCKET}/{KEY}"
    assert s3.seen.requests and all(request["query"] == url.split("?")[1] for request in s3.seen.requests)
    gone = url.replace("drive.mcap", "gone.mcap")
    for words in (["info", url], ["info", url, "--json"], ["annotate", url, "-o", output, "--json"],
                  ["info", gone], ["explain", url, "--frame", 999], ["triage", url, "--frames", "99"],
                  ["figure", url, "--frame", 999, "-o", tmp_path / "a.png"], ["failures", url, "--frames", "..1"],
                  ["annotate", gone, url, "-o", tmp_path / "both"], ["evaluate", gone], ["diff", url, gone]):
        done = start(*words)
        for secret in secrets:
            assert secret not in done.stdout + done.stderr, words
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert written
    for path in written:
        assert not any(secret in path.name or secret.encode() in path.read_bytes() for secret in secrets)


def test_a_password_is_sent_and_not_shown(small, web):
    sent = "Basic " + base64.b64encode(f"me@home:{SECRET}/".encode()).decode()
    served = web(small.read_bytes(), needs={"Authorization": sent})
    url = served.address.replace("http://", f"http://me%40home:{SECRET}%2F@")
    told = run("info", url)
    assert served.address in told and SECRET not in told
    said = refused("info", url.replace("%2F", ""))
    assert "access denied" in said and served.address in said and SECRET not in said


def test_servers_of_all_kinds(drive, tmp_path, web):
    _, expected = annotated(drive, tmp_path)
    content = drive.read_bytes()
    for how in ({}, {"ranges": "no suffix"}, {"tag": None}, {"tag": 'W/"weak"'}, {"compares": False}):
        served = web(content, **how)
        report, found = annotated(served.address, tmp_path)
        assert found == expected, how
        assert report["fetched"]["bytes"] == len(content), how
        assert {request["if_match"] for request in served.seen.requests} <= {None, '"one"'}, how


def test_other_stores_as_their_clients_ask_them(drive, tmp_path, web):
    """Not those stores: a server that answers as they do."""
    _, expected = annotated(drive, tmp_path)
    google, azure = web(drive.read_bytes()), web(drive.read_bytes(), ranges="no suffix")
    google.date = azure.date = "Mon, 02 Jan 2023 03:04:05 GMT"
    account = tmp_path / "account.json"
    account.write_text(json.dumps({"gcs_base_url": f"http://127.0.0.1:{google.server_port}", "disable_oauth": True,
                                   "client_email": "", "private_key": "", "private_key_id": ""}))
    report, found = annotated("gs://bucket/a b/drive.mcap", tmp_path, GOOGLE_SERVICE_ACCOUNT=str(account))
    assert found == expected and report["fetched"]["bytes"] == google.seen.bytes == drive.stat().st_size
    paths = {urllib.parse.unquote(request["path"]) for request in google.seen.requests}
    assert paths == {"/bucket/a b/drive.mcap"}
    report, found = annotated(
        "az://container/a/drive.mcap", tmp_path, AZURE_STORAGE_ACCOUNT_NAME="account", AZURE_SKIP_SIGNATURE="true",
        AZURE_ALLOW_HTTP="true", AZURE_ENDPOINT=f"http://127.0.0.1:{azure.server_port}")
    assert found == expected and report["fetched"]["bytes"] == azure.seen.bytes == drive.stat().st_size
    assert {request["path"] for request in azure.seen.requests} == {"/container/a/drive.mcap"}
    assert not any(request["range"].startswith("bytes=-") for request in azure.seen.requests)


def test_a_server_that_sends_elsewhere(small, tmp_path, web):
    served, before = web(small.read_bytes(), query=f"token={SECRET}"), web(b"")
    before.moved_to = f"{served.address}?{served.query}"
    report, found = annotated(before.address, tmp_path)
    assert report["input"] == before.address and served.seen.bytes == small.stat().st_size
    served.query = "another"
    said = refused("info", before.address)
    assert before.address in said and "access denied" in said and SECRET not in said


def test_a_change_is_seen_whatever_the_server_compares(drive, tmp_path, web):
    content = drive.read_bytes()

    def changes(server, tag, content):
        def change():
            server.tag, server.content = tag, content
        return change

    for how, tag in (({}, '"two"'), ({"compares": False}, '"two"'), ({"tag": 'W/"weak"'}, 'W/"two"')):
        served = web(content, **how)
        served.seen.before[4] = changes(served, tag, content)
        said = refused("annotate", served.address, "-o", tmp_path / "out.mcap")
        assert said == f"{served.address}: the object changed while it was read", how
    # Without any mark the size tells.
    served = web(content, tag=None)
    served.seen.before[4] = changes(served, None, content[:-1])
    assert "changed while it was read" in refused("annotate", served.address, "-o", tmp_path / "out.mcap")


def test_a_server_without_ranges_is_named(drive, web):
    served = web(drive.read_bytes(), ranges="none")
    said = refused("info", served.address)
    assert "answers no range requests" in said and said.startswith(served.address)
    with open(drive, "rb") as piped:
        done = subprocess.run([BINARY, "annotate", "-", "-o", "-", "--only"], stdin=piped, capture_output=True)
    assert done.returncode == 0


def test_what_breaks_off_for_once_goes_on(drive, tmp_path, web):
    _, expected = annotated(drive, tmp_path)
    served = web(drive.read_bytes())
    served.cut, served.failing = {3, 6}, {1, 8}
    report, found = annotated(served.address, tmp_path)
    assert found == expected
    assert len(served.seen.requests) > report["fetched"]["requests"]


@pytest.mark.parametrize("at", [1, 5])
def test_ctrl_c_ends_what_waits(drive, tmp_path, web, at):
    served = web(drive.read_bytes())
    waiting, ends = threading.Event(), threading.Event()

    def stall():
        waiting.set()
        ends.wait()

    for number in range(at, 50):
        served.seen.before[number] = stall
    output = tmp_path / "out.mcap"
    words = [BINARY, "annotate", served.address, "-o", output, "--json"]
    process = subprocess.Popen(words, env=environment(), stderr=subprocess.PIPE, text=True)
    assert waiting.wait(60)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    ends.set()
    assert process.returncode == 130 and "interrupted" in said, said
    assert not output.exists()


def certificate(folder):
    """A certificate of this machine, by an authority of its own."""
    x509 = needed("cryptography.x509")
    from cryptography.hazmat.primitives import hashes, serialization
    from cryptography.hazmat.primitives.asymmetric import ec

    begins = datetime.datetime.now(datetime.timezone.utc) - datetime.timedelta(days=1)

    def made(name, key, issuer, by, *extensions):
        names = [x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, n)]) for n in (name, issuer)]
        builder = x509.CertificateBuilder(issuer_name=names[1], subject_name=names[0], public_key=key.public_key(),
                                          serial_number=x509.random_serial_number(), not_valid_before=begins,
                                          not_valid_after=begins + datetime.timedelta(days=30))
        for extension, critical in extensions:
            builder = builder.add_extension(extension, critical)
        return builder.sign(by, hashes.SHA256()).public_bytes(serialization.Encoding.PEM)

    authority, own = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
    root, leaf, key = folder / "root.pem", folder / "leaf.pem", folder / "key.pem"
    root.write_bytes(made("authority", authority, "authority", authority,
                          (x509.BasicConstraints(ca=True, path_length=None), True)))
    host = x509.SubjectAlternativeName([x509.IPAddress(ipaddress.ip_address("127.0.0.1"))])
    leaf.write_bytes(made("here", own, "authority", authority, (host, False),
                          (x509.BasicConstraints(ca=False, path_length=None), True)))
    key.write_bytes(own.private_bytes(serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
                                      serialization.NoEncryption()))
    return root, leaf, key


def test_https_with_a_certificate_that_is_known_or_not(small, tmp_path):
    root, leaf, key = certificate(tmp_path)
    served = Web(small.read_bytes())
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(leaf, key)
    served.socket = context.wrap_socket(served.socket, server_side=True)
    threading.Thread(target=served.serve_forever, daemon=True).start()
    url = served.address.replace("http://", "https://")
    told = json.loads(run("info", url, "--json", SSL_CERT_FILE=str(root)))
    assert told["bytes"] == small.stat().st_size
    assert "certificate" in refused("info", url)
    served.shutdown()
    served.server_close()
