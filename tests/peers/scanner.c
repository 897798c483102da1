/* The driver of the example's scanner, as somebody else would write it: in C, with Debian's Cyclone DDS, and nothing of
 * scbm. It takes requests in two ways, and works on each for a while:
 *
 *   /scanner/scan_item_a       a service, std_srvs/srv/Trigger
 *   /scanner/request, /reply   the protocol of docs/reference/node-protocol.md, std_msgs/msg/String
 *
 * When it starts, and whenever it has scanned, it publishes /scanner/distance, std_msgs/msg/Float64.
 * On standard output it says what it does, a line each.
 */

#include <getopt.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dds/dds.h"
#include "messages.h"

#define JOBS 256
#define TEXT 256
#define LOOKS_AT_LEAST_EVERY DDS_MSECS(100)
#define WAITS_FOR_CLIENT DDS_MSECS(100)
#define LOOKS_FOR_CLIENT_EVERY DDS_MSECS(5)

typedef std_msgs_msg_dds__String_ String;
typedef std_msgs_msg_dds__Float64_ Float64;
typedef std_srvs_srv_dds__Trigger_Request_ Request;
typedef std_srvs_srv_dds__Trigger_Response_ Response;

typedef struct {
  bool is_used;
  dds_time_t due;
  char id[TEXT];                /* of the protocol; empty if this is a call of the service */
  uint64_t guid;                /* of a call of the service, as are the others */
  int64_t seq;
  dds_instance_handle_t writer;
  dds_time_t given_up;
} Job;

static struct {
  dds_domainid_t domain;
  dds_duration_t works;
  bool fails;
  long exits_after;             /* so many replies; -1: never */
  double distance;
  const char *measured;         /* a JSON object */
} options = {0, DDS_MSECS(10), false, -1, 0.25, NULL};

static Job jobs[JOBS];
static long replies;
static dds_entity_t participant, topic_requests, topic_replies, calls, responses, distances;
static volatile sig_atomic_t is_stopped;

static int checked(int32_t result, const char *what)
{
  if (result < 0) {
    fprintf(stderr, "scanner: %s: %s\n", what, dds_strretcode(-result));
    exit(1);
  }
  return result;
}

/* JSON, as far as it is needed: the members of the outermost object, their values as they are written. */

static const char *after_space(const char *text)
{
  return text + strspn(text, " \t\n\r");
}

static const char *after_string(const char *text)
{
  if (*text != '"')
    return NULL;
  for (text++; *text != '"'; text++) {
    if ((unsigned char) *text < ' ' || (*text == '\\' && *++text == '\0'))
      return NULL;
  }
  return text + 1;
}

static const char *after_value(const char *text);

/* Behind an array or an object. If `name` is one of its keys, `value` becomes where its value begins. */
static const char *after_items(const char *text, const char *name, const char **value)
{
  const bool is_object = *text == '{';
  const char end = is_object ? '}' : ']';
  text = after_space(text + 1);
  if (*text == end)
    return text + 1;
  for (;;) {
    if (is_object) {
      const char *key = text + 1;
      if (!(text = after_string(text)))
        return NULL;
      const bool is_meant = name && strlen(name) == (size_t) (text - 1 - key) && !strncmp(key, name, strlen(name));
      if (*(text = after_space(text)) != ':')
        return NULL;
      text = after_space(text + 1);
      if (is_meant)
        *value = text;
    }
    if (!(text = after_value(text)))
      return NULL;
    text = after_space(text);
    if (*text == end)
      return text + 1;
    if (*text != ',')
      return NULL;
    text = after_space(text + 1);
  }
}

static const char *after_value(const char *text)
{
  static const char *const words[] = {"true", "false", "null"};
  if (*text == '{' || *text == '[')
    return after_items(text, NULL, NULL);
  if (*text == '"')
    return after_string(text);
  for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
    if (!strncmp(text, words[i], strlen(words[i])))
      return text + strlen(words[i]);
  }
  const size_t length = strspn(text, "+-.0123456789eE");
  return length ? text + length : NULL;
}

/* The value of a member, as it is written; NULL if there is none, or if the text is not one object. */
static const char *member(const char *json, const char *name, size_t *length)
{
  const char *value = NULL;
  json = after_space(json);
  const char *end = *json == '{' ? after_items(json, name, &value) : NULL;
  if (!end || *after_space(end) != '\0' || !value)
    return NULL;
  *length = (size_t) (after_value(value) - value);
  return value;
}

/* Jobs. */

static Job *new_job(void)
{
  for (Job *job = jobs; job < jobs + JOBS; job++) {
    if (!job->is_used) {
      *job = (Job) {.is_used = true, .due = dds_time() + options.works};
      job->given_up = job->due + WAITS_FOR_CLIENT;
      return job;
    }
  }
  fprintf(stderr, "scanner: more than %d requests at a time\n", JOBS);
  exit(1);
}

static Job *job_of(const char *id)
{
  for (Job *job = jobs; job < jobs + JOBS; job++) {
    if (job->is_used && !strcmp(job->id, id))
      return job;
  }
  return NULL;
}

static void publish_distance(void)
{
  const Float64 message = {options.distance};
  checked(dds_write(distances, &message), "distance");
}

static void reply(const Job *job)
{
  static const char plain[] = "{\"id\": %s, \"succeeded\": %s}";
  static const char measured[] = "{\"id\": %s, \"succeeded\": %s, \"measured\": %s}";
  const char *format = options.measured && !options.fails ? measured : plain;
  char *text = NULL;
  if (asprintf(&text, format, job->id, options.fails ? "false" : "true", options.measured) < 0)
    abort();
  const String message = {text};
  checked(dds_write(topic_replies, &message), "reply");
  free(text);
  printf("replied to %s\n", job->id);
}

static void respond(const Job *job)
{
  const Response response = {job->guid, job->seq, !options.fails, options.fails ? "nothing in sight" : "scanned"};
  checked(dds_write(responses, &response), "response");
  printf("responded to call %lld\n", (long long) job->seq);
}

/* Who an endpoint says it is: its user data to the first semicolon, "clientid=…;"; an empty text if it does not. */
static void identity(dds_builtintopic_endpoint_t *endpoint, char text[TEXT])
{
  void *data = NULL;
  size_t size = 0;
  text[0] = '\0';
  if (endpoint && dds_qget_userdata(endpoint->qos, &data, &size) && data && size < TEXT) {
    memcpy(text, data, size);
    text[size] = '\0';
    text[strcspn(text, ";")] = '\0';
  }
  dds_free(data);
  if (endpoint)
    dds_builtintopic_free_endpoint(endpoint);
}

/* Whether the reader of a client is there; if not, its response would be lost. */
static bool is_heard_by(dds_instance_handle_t writer)
{
  char client[TEXT], found[TEXT];
  identity(dds_get_matched_publication_data(calls, writer), client);
  bool is_there = client[0] == '\0';
  dds_instance_handle_t readers[JOBS];
  const int count = checked(dds_get_matched_subscriptions(responses, readers, JOBS), "readers");
  for (int i = 0; i < count && i < JOBS && !is_there; i++) {
    identity(dds_get_matched_subscription_data(responses, readers[i]), found);
    is_there = !strcmp(found, client);
  }
  return is_there;
}

static void finish(Job *job)
{
  const bool is_call = job->id[0] == '\0';
  if (is_call && !is_heard_by(job->writer) && dds_time() < job->given_up) {
    job->due = dds_time() + LOOKS_FOR_CLIENT_EVERY;
    return;
  }
  if (!options.fails)
    publish_distance();
  (is_call ? respond : reply)(job);
  job->is_used = false;
  replies++;
}

static void finish_due(void)
{
  for (Job *job = jobs; job < jobs + JOBS && replies != options.exits_after; job++) {
    if (job->is_used && job->due <= dds_time())
      finish(job);
  }
}

static dds_duration_t until_next(void)
{
  dds_duration_t next = LOOKS_AT_LEAST_EVERY;
  for (const Job *job = jobs; job < jobs + JOBS; job++) {
    if (job->is_used && job->due - dds_time() < next)
      next = job->due - dds_time();
  }
  return next > 0 ? next : 0;
}

/* What comes. */

static void take_message(const String *message)
{
  char id[TEXT];
  size_t id_length, length;
  const char *written = member(message->data, "id", &id_length);
  const char *cancel = member(message->data, "cancel", &length);
  const char *request = member(message->data, "request", &length);
  if (!written || written[0] != '"' || id_length >= TEXT) {
    printf("not of the protocol: %s\n", message->data);
    return;
  }
  memcpy(id, written, id_length);
  id[id_length] = '\0';
  Job *job = job_of(id);
  if (cancel && *cancel == 't') {
    if (job)
      job->is_used = false;
    printf("cancelled %s\n", id);
  } else if (request && *request == '{' && !job) {
    strcpy(new_job()->id, id);
    printf("took %s\n", id);
  } else {
    printf("not of the protocol: %s\n", message->data);
  }
}

static void take_call(const Request *request, const dds_sample_info_t *info)
{
  Job *job = new_job();
  job->guid = request->guid;
  job->seq = request->seq;
  job->writer = info->publication_handle;
  printf("took call %lld\n", (long long) job->seq);
}

static void take_all(dds_entity_t reader)
{
  void *sample = NULL;
  dds_sample_info_t info;
  while (checked(dds_take(reader, &sample, &info, 1, 1), "take") > 0) {
    if (info.valid_data && reader == calls)
      take_call(sample, &info);
    else if (info.valid_data)
      take_message(sample);
    checked(dds_return_loan(reader, &sample, 1), "return");
  }
}

/* Endpoints: reliable, of XCDR1, and they keep all. */

static dds_qos_t *qualities(dds_durability_kind_t durability, const char *user_data)
{
  dds_qos_t *qos = dds_create_qos();
  const dds_data_representation_id_t xcdr1 = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, durability);
  dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
  dds_qset_writer_data_lifecycle(qos, false);
  dds_qset_data_representation(qos, 1, &xcdr1);
  if (user_data)
    dds_qset_userdata(qos, user_data, strlen(user_data));
  return qos;
}

typedef dds_entity_t Create(dds_entity_t, dds_entity_t, const dds_qos_t *, const dds_listener_t *);

static dds_entity_t endpoint(Create *create, const dds_topic_descriptor_t *type, const char *name, dds_qos_t *qos)
{
  const dds_entity_t topic = checked(dds_create_topic(participant, type, name, NULL, NULL), name);
  const dds_entity_t made = checked(create(participant, topic, qos, NULL), name);
  dds_delete_qos(qos);
  return made;
}

static void open_endpoints(void)
{
  char service[TEXT];
  dds_guid_t guid;
  participant = checked(dds_create_participant(options.domain, NULL, NULL), "participant");
  checked(dds_get_guid(participant, &guid), "id");
  strcpy(service, "serviceid=");
  for (size_t i = 0; i < sizeof guid.v; i++)
    snprintf(service + strlen(service), 4, i ? ".%x" : "%x", guid.v[i]);
  strcat(service, ";");

  const dds_durability_kind_t volatile_ = DDS_DURABILITY_VOLATILE, latched = DDS_DURABILITY_TRANSIENT_LOCAL;
  topic_replies = endpoint(dds_create_writer, &std_msgs_msg_dds__String__desc, "rt/scanner/reply",
                           qualities(volatile_, NULL));
  topic_requests = endpoint(dds_create_reader, &std_msgs_msg_dds__String__desc, "rt/scanner/request",
                            qualities(volatile_, NULL));
  distances = endpoint(dds_create_writer, &std_msgs_msg_dds__Float64__desc, "rt/scanner/distance",
                       qualities(latched, NULL));
  responses = endpoint(dds_create_writer, &std_srvs_srv_dds__Trigger_Response__desc, "rr/scanner/scan_item_aReply",
                       qualities(volatile_, service));
  calls = endpoint(dds_create_reader, &std_srvs_srv_dds__Trigger_Request__desc, "rq/scanner/scan_item_aRequest",
                   qualities(volatile_, service));
}

static void work(void)
{
  const dds_entity_t waits = checked(dds_create_waitset(participant), "waitset");
  checked(dds_set_status_mask(topic_requests, DDS_DATA_AVAILABLE_STATUS), "status");
  checked(dds_set_status_mask(calls, DDS_DATA_AVAILABLE_STATUS), "status");
  checked(dds_waitset_attach(waits, topic_requests, 0), "attach");
  checked(dds_waitset_attach(waits, calls, 0), "attach");
  while (!is_stopped && replies != options.exits_after) {
    take_all(topic_requests);
    take_all(calls);
    finish_due();
    checked(dds_waitset_wait(waits, NULL, 0, until_next()), "wait");
  }
}

static void read_options(int count, char **words)
{
  static const struct option known[] = {
    {"domain", required_argument, NULL, 'd'},   {"works-ms", required_argument, NULL, 'w'},
    {"fails", no_argument, NULL, 'f'},          {"exit-after", required_argument, NULL, 'e'},
    {"distance", required_argument, NULL, 'm'}, {"measured", required_argument, NULL, 'j'},
    {0}};
  for (int option; (option = getopt_long(count, words, "", known, NULL)) != -1;) {
    switch (option) {
    case 'd': options.domain = (dds_domainid_t) strtoul(optarg, NULL, 10); break;
    case 'w': options.works = DDS_MSECS(strtol(optarg, NULL, 10)); break;
    case 'f': options.fails = true; break;
    case 'e': options.exits_after = strtol(optarg, NULL, 10); break;
    case 'm': options.distance = strtod(optarg, NULL); break;
    case 'j': options.measured = optarg; break;
    default:
      fprintf(stderr, "usage: scanner [--domain N] [--works-ms N] [--fails] [--exit-after REPLIES] "
                      "[--distance METRES] [--measured JSON]\n");
      exit(2);
    }
  }
}

static void stop(int signal)
{
  (void) signal;
  is_stopped = 1;
}

int main(int count, char **words)
{
  read_options(count, words);
  setvbuf(stdout, NULL, _IOLBF, 0);
  signal(SIGTERM, stop);
  signal(SIGINT, stop);
  open_endpoints();
  publish_distance();
  puts("ready");
  work();
  checked(dds_delete(participant), "end");
  puts("gone");
  return 0;
}
