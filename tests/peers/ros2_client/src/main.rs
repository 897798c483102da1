//! A node of ROS 2 as somebody else would write it: in Rust, with ros2-client on RustDDS, and nothing of scbm or of
//! Cyclone DDS. It stays on the loopback interface. On standard output it says what it does, a line each.
//!
//!   nodes NAME...        ends when it has seen them all on ros_discovery_info, as `ros2 node list` would
//!   driver               of the example's scanner:
//!                          /scanner/scan_item_a      a service, std_srvs/srv/Trigger
//!                          /scanner/light            a service, std_srvs/srv/SetBool
//!                          /scanner/request, /reply  the protocol of docs/reference/node-protocol.md, std_msgs/msg/String
//!                          /scanner/sees             std_msgs/msg/Bool, latched
//!   call NAME            a service, std_srvs/srv/Trigger: for each message of /scanner/request, "probe" or so many calls;
//!                        only for the latter it awaits the responses
//!   gantry               an action server, /gantry: see scripted.rs and trajectories.rs
//!   navigator            an action server, /navigate_to_pose: see scripted.rs and navigation.rs
//!
//! All but `nodes` say `matched TOPIC` for each topic of DDS on which they and another node have found each other.
//! What they send then is heard a moment later: volatile readers of Cyclone DDS drop what comes from other vendors before
//! the first heartbeat that is meant for them.

mod navigation;
mod scripted;
mod trajectories;

use std::{env, net::Ipv4Addr, pin::pin};

use futures::{executor::block_on, join, StreamExt};
use ros2_client::{
    action::{ActionServerQosPolicies, AsyncActionServer},
    dds::rustdds::{
        DomainParticipant, DomainParticipantBuilder, DomainParticipantStatusEvent as Event,
        StatusEvented, Topic,
    },
    entities_info::ParticipantEntitiesInfo,
    qos::{Durability, History, WhenFull},
    ActionTypeName, Client, Context, Message, MessageTypeName, Name, Node, NodeName, NodeOptions,
    Publisher, QosProfile, Server, ServiceMapping, ServiceTypeName, Subscription,
};
use serde::{Deserialize, Serialize};

#[derive(Clone, Serialize, Deserialize)]
struct Nothing {
    structure_needs_at_least_one_member: u8,
}

#[derive(Clone, Serialize, Deserialize)]
struct Switch {
    data: bool,
}

#[derive(Clone, Serialize, Deserialize)]
struct Response {
    success: bool,
    message: String,
}

impl Message for Nothing {}
impl Message for Switch {}
impl Message for Response {}

/// With a depth: of "keep all" RustDDS keeps 64.
fn reliable() -> QosProfile {
    QosProfile::publisher_default()
        .reliability_reliable(WhenFull::Block)
        .history(History::KeepLast { depth: 1024 })
}

fn latched() -> QosProfile {
    reliable().durability(Durability::TransientLocal)
}

fn name(text: &str) -> Name {
    let (namespace, base) = text.rsplit_once('/').expect("a name from the root");
    Name::new(if namespace.is_empty() { "/" } else { namespace }, base).expect(text)
}

struct Peer {
    participant: DomainParticipant,
    context: Context,
    node: Node,
}

impl Peer {
    fn new(domain: u16) -> Peer {
        let participant = DomainParticipantBuilder::new(domain)
            .with_only_networks([Ipv4Addr::LOCALHOST])
            .build();
        let participant = participant.expect("a participant");
        let context = Context::from_domain_participant(participant.clone()).expect("a context");
        let options = NodeOptions::new().enable_rosout(false);
        let node = context
            .new_node(NodeName::new("/", "ros2_peer").unwrap(), options)
            .expect("a node");
        Peer {
            participant,
            context,
            node,
        }
    }

    fn topic(&self, topic: &str, type_name: &str, qos: QosProfile) -> Topic {
        self.node
            .create_topic(
                &name(topic),
                MessageTypeName::new("std_msgs", type_name),
                &qos,
            )
            .expect(topic)
    }

    fn publisher<M: Serialize>(
        &mut self,
        topic: &str,
        type_name: &str,
        qos: QosProfile,
    ) -> Publisher<M> {
        let made = self.topic(topic, type_name, qos);
        self.node.create_publisher(&made, None).expect(topic)
    }

    fn subscription<M: 'static>(
        &mut self,
        topic: &str,
        type_name: &str,
        qos: QosProfile,
    ) -> Subscription<M> {
        let made = self.topic(topic, type_name, qos);
        self.node.create_subscription(&made, None).expect(topic)
    }

    fn server<R: Message + Clone + 'static>(
        &mut self,
        service: &str,
        type_name: &str,
    ) -> Server<R, Response> {
        let type_name = ServiceTypeName::new("std_srvs", type_name);
        self.node
            .create_server(
                ServiceMapping::Cyclone,
                &name(service),
                &type_name,
                reliable(),
                reliable(),
            )
            .expect(service)
    }

    fn client(&mut self, service: &str) -> Client<Nothing, Response> {
        let type_name = ServiceTypeName::new("std_srvs", "Trigger");
        self.node
            .create_client(
                ServiceMapping::Cyclone,
                &name(service),
                &type_name,
                reliable(),
                reliable(),
            )
            .expect(service)
    }

    fn action_server<G, R, F>(
        &mut self,
        action: &str,
        package: &str,
        type_name: &str,
    ) -> AsyncActionServer<G, R, F>
    where
        G: Message + Clone + 'static,
        R: Message + Clone + 'static,
        F: Message + 'static,
    {
        let qos = ActionServerQosPolicies {
            goal_service: reliable(),
            result_service: reliable(),
            cancel_service: reliable(),
            feedback_publisher: reliable(),
            status_publisher: latched().history(History::KeepLast { depth: 1 }),
        };
        let kind = ActionTypeName::new(package, type_name);
        let made =
            self.node
                .create_action_server(ServiceMapping::Cyclone, &name(action), &kind, qos);
        AsyncActionServer::new(made.expect(action))
    }

    // Waiting for services as ros2-client does takes its events from a queue of eight, and hangs if they are more.
    async fn tell_matches(&self) {
        let listener = self.participant.status_listener();
        let mut events = listener.as_async_status_stream();
        while let Some(event) = events.next().await {
            if let Some(topic) = self.matched_topic(event) {
                println!("matched {topic}");
            }
        }
    }

    fn matched_topic(&self, event: Event) -> Option<String> {
        match event {
            Event::RemoteReaderMatched { remote_reader, .. } => {
                let mut readers = self.participant.discovered_readers().into_iter();
                let found =
                    readers.find(|data| data.reader_proxy.remote_reader_guid == remote_reader);
                found.map(|data| data.subscription_topic_data.topic_name)
            }
            Event::RemoteWriterMatched { remote_writer, .. } => {
                let mut writers = self.participant.discovered_writers().into_iter();
                let found =
                    writers.find(|data| data.writer_proxy.remote_writer_guid == remote_writer);
                found.map(|data| data.publication_topic_data.topic_name)
            }
            _ => None,
        }
    }
}

async fn nodes(mut peer: Peer, mut awaited: Vec<&str>) {
    let type_name = MessageTypeName::new("rmw_dds_common", "ParticipantEntitiesInfo");
    let topic = peer
        .context
        .create_topic("ros_discovery_info".into(), type_name, &latched())
        .expect("a topic");
    let infos: Subscription<ParticipantEntitiesInfo> =
        peer.node.create_subscription(&topic, None).expect("infos");
    println!("ready");
    let mut infos = pin!(infos.async_stream());
    while !awaited.is_empty() {
        let (info, _) = infos
            .select_next_some()
            .await
            .expect("the nodes of a participant");
        for found in info.nodes().iter().map(|node| node.fully_qualified_name()) {
            awaited.retain(|name| *name != found);
            println!("{found}");
        }
    }
}

async fn serve<R: Message + Clone + 'static>(
    server: Server<R, Response>,
    reply: impl Fn(R) -> Response,
) {
    let mut requests = server.receive_request_stream();
    loop {
        let (id, request) = requests.select_next_some().await.expect("a request");
        server
            .async_send_response(id, reply(request))
            .await
            .expect("a response");
        println!("responded");
    }
}

/// Enough JSON for requests: the value of `id` without its quotes.
fn id_of(request: &str) -> &str {
    let (_, behind) = request.split_once("\"id\":").expect("an id");
    behind.split('"').nth(1).expect("an id in quotes")
}

async fn answer(requests: Subscription<String>, replies: Publisher<String>) {
    let mut requests = pin!(requests.async_stream());
    loop {
        let (request, _) = requests.select_next_some().await.expect("a message");
        println!("took {request}");
        let reply = format!("{{\"id\": \"{}\", \"succeeded\": true}}", id_of(&request));
        replies.async_publish(reply).await.expect("a reply");
    }
}

async fn driver(mut peer: Peer) {
    let scans = peer.server::<Nothing>("/scanner/scan_item_a", "Trigger");
    let lights = peer.server::<Switch>("/scanner/light", "SetBool");
    let requests = peer.subscription("/scanner/request", "String", reliable());
    let replies = peer.publisher("/scanner/reply", "String", reliable());
    let sees = peer.publisher("/scanner/sees", "Bool", latched());
    sees.async_publish(true).await.expect("a measurement");
    println!("ready");
    join!(
        serve(scans, |_| Response {
            success: true,
            message: "scanned".into()
        }),
        serve(lights, |switch| Response {
            success: switch.data,
            message: format!("light {}", switch.data)
        }),
        answer(requests, replies),
        peer.tell_matches(),
    );
}

async fn call(mut peer: Peer, service: &str) {
    let client = peer.client(service);
    // Behind the client: who has matched these, has matched it.
    let _sees = peer.publisher::<bool>("/scanner/sees", "Bool", latched());
    let requests = peer.subscription::<String>("/scanner/request", "String", reliable());
    println!("ready");
    let work = async {
        let mut requests = pin!(requests.async_stream());
        loop {
            let (request, _) = requests.select_next_some().await.expect("a message");
            let count: usize = request.parse().unwrap_or(1);
            let mut calls = Vec::new();
            for _ in 0..count {
                let nothing = Nothing {
                    structure_needs_at_least_one_member: 0,
                };
                calls.push(client.async_send_request(nothing).await.expect("a request"));
            }
            println!("called {request}");
            if request != "probe" {
                for id in calls {
                    let response = client.async_receive_response(id).await.expect("a response");
                    assert!(response.success && response.message.starts_with("latched"));
                }
                println!("answered {request}");
            }
        }
    };
    join!(work, peer.tell_matches());
}

fn main() {
    let words: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let number = |text: &str| text.parse().expect("a number");
    match words[..] {
        ["--domain", domain, "nodes", ref names @ ..] => {
            block_on(nodes(Peer::new(number(domain)), names.to_vec()))
        }
        ["--domain", domain, "driver"] => block_on(driver(Peer::new(number(domain)))),
        ["--domain", domain, "call", service] => block_on(call(Peer::new(number(domain)), service)),
        ["--domain", domain, "gantry"] => {
            let mut peer = Peer::new(number(domain));
            let script = trajectories::Trajectories::new(&mut peer);
            block_on(scripted::serve(peer, script))
        }
        ["--domain", domain, "navigator"] => {
            let peer = Peer::new(number(domain));
            block_on(scripted::serve(peer, navigation::Navigation))
        }
        _ => panic!(
            "usage: ros2_peer --domain N nodes NAME... | driver | call NAME | gantry | navigator"
        ),
    }
}
