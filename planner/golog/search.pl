:- module(planner_search,
          [ best_plan/4,                % +Program, +Situation, +MaxNodes, -Result
            calls/3,                    % +Program, +Situation, -Heads
            lumped/4                    % +Program, +Situation, -Program, -Situation
          ]).

/** <module> The least makespan of all executions of a program

Best-first search (A*) over configurations Program-Situation. A configuration has two kinds of
successors: a transition of the program, which starts a step now, and the passing of time to the next
natural end of a running step. A configuration is worth m-w: m is a lower bound of the makespan of
every execution that goes on from it, w of their total robot time. The bounds never overestimate, so
the first complete execution taken from the queue has the least makespan and, of those, the least
robot time; its makespan is its own proof (Hart, Nilsson, Raphael 1968).

Lower bound of what remains: the larger of the longest chain (sequences add up, concurrent parts do
not) and all robot time that remains over the number of robots.
*/

:- use_module(library(heaps)).
:- use_module(library(rbtrees)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(assoc)).
:- use_module(kb_rules(facts), [duration/3, definition/4, kind/3]).
:- use_module(kb_rules(capability), [capable/3]).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(transition)).

%   Longer than any plan: what an impossible program takes.
never(1_000_000_000_000).

%!  best_plan(+Program, +Situation, +MaxNodes:integer, -Result) is det.
%
%   Result is one of
%     - plan(Status, Makespan, Bound, Events, Nodes): Status is optimal or satisficing; Events, oldest
%       first, are what trans/4 noted; Makespan and Bound are milliseconds from now
%     - none(proven, Nodes): no execution exists
%     - none(unknown, Nodes): none was found within MaxNodes

best_plan(P0, S0, MaxNodes, Result) :-
    now(S0, Start),
    team_size(S0, Robots),
    settle(P0, S0, P, S),
    worth(P, S, 0, Robots, Worth),
    empty_heap(Heap0),
    queue(Worth, 0, n(P, S, 0), Heap0, Heap, 0, Next),
    rb_new(Seen),
    search(Heap, Seen, Next, 0, MaxNodes, Robots, Start, Result).

search(Heap, Seen, Next, Nodes, MaxNodes, Robots, Start, Result) :-
    (   get_from_heap(Heap, p(Bound, _, _), n(P, S, Work), Heap1)
    ->  never(Never),
        (   Bound >= Never
        ->  Result = none(proven, Nodes)
        ;   complete(P, S)
        ->  now(S, End),
            log(S, Log),
            reverse(Log, Events),
            Makespan is End - Start,
            Result = plan(optimal, Makespan, Makespan, Events, Nodes)
        ;   Nodes >= MaxNodes
        ->  LowerBound is Bound - Start,
            first_found(P, S, Start, LowerBound, Nodes, Result)
        ;   expand(P, S, Work, Robots, Seen, Seen1, Heap1, Heap2, Next, Next1),
            Nodes1 is Nodes + 1,
            search(Heap2, Seen1, Next1, Nodes1, MaxNodes, Robots, Start, Result)
        )
    ;   Result = none(proven, Nodes)
    ).

complete(P, S) :-
    running(S, []),
    final(P, S), !.

expand(P, S, Work, Robots, Seen, Seen1, Heap, Heap1, Next, Next1) :-
    configuration_key(P, S, Key),
    (   rb_lookup(Key, _, Seen)
    ->  Seen1 = Seen, Heap1 = Heap, Next1 = Next
    ;   rb_insert_new(Seen, Key, true, Seen1),
        findall(n(Q, T, W), successor(P, S, Work, Q, T, W), Nodes),
        foldl(add_node(Robots), Nodes, Heap-Next, Heap1-Next1)
    ).

add_node(Robots, n(P, S, Work), Heap0-Next0, Heap-Next) :-
    worth(P, S, Work, Robots, Worth),
    (   Worth = Makespan-_, never(Never), Makespan >= Never
    ->  Heap = Heap0, Next = Next0
    ;   queue(Worth, Next0, n(P, S, Work), Heap0, Heap, Next0, Next)
    ).

%   Of equal worth, the latest first: a plan that is as good is completed, not compared.
queue(Makespan-Robot_time, Order, Node, Heap0, Heap, Next0, Next) :-
    Latest is -Order,
    add_to_heap(Heap0, p(Makespan, Robot_time, Latest), Node, Heap),
    Next is Next0 + 1.

configuration_key(P, S, Key) :-
    progressed(S, Progressed),
    copy_term(P-Progressed, Key),
    numbervars(Key, 0, _).

%!  successor(+Program, +Situation, +Work, -Program, -Situation, -Work) is nondet.

successor(P, S, Work, Q, T, Work1) :-
    trans(P, S, Q, T),
    log(T, [Newest|_]),
    robot_time(Newest, Time),
    Work1 is Work + Time.
successor(P, S, Work, Q, T, Work) :-
    time_passes(S, S1),
    settle(P, S1, Q, T).

robot_time(started(_, _, Agent, From, To), Time) :- Agent \== none, !, Time is To - From.
robot_time(_, 0).

%   To the next natural end; everything that ends then has ended.
time_passes(S0, S) :-
    next_end(S0, End),
    at_time(S0, End, S1),
    end_runs(End, S1, S).

end_runs(End, S0, S) :-
    (   running(S0, [run(End, _, Id, Head)|_])
    ->  stop(Id, S0, S1),
        apply_effects(Head, S1, S2),
        end_runs(End, S2, S)
    ;   S = S0
    ).

%   Budget spent: one execution from the most promising configuration on, without going back.
first_found(P, S, Start, Bound, Nodes, Result) :-
    (   dive(P, S, T)
    ->  now(T, End),
        log(T, Log),
        reverse(Log, Events),
        Makespan is End - Start,
        Result = plan(satisficing, Makespan, Bound, Events, Nodes)
    ;   Result = none(unknown, Nodes)
    ).

dive(P, S, S) :- complete(P, S), !.
dive(P, S, End) :-
    team_size(S, Robots),
    findall(Worth-(Q-T), ( successor(P, S, 0, Q, T, W), worth(Q, T, W, Robots, Worth) ), Nodes),
    keysort(Nodes, [_-(Best-Then)|_]),
    dive(Best, Then, End).

team_size(S, Size) :-
    revision(S, Revision),
    findall(R, kind(Revision, R, 'Robot'), Robots0),
    sort(Robots0, Robots),
    length(Robots, All),
    limit(S, Limit),
    Size is max(1, min(All, Limit)).

%!  worth(+Program, +Situation, +Work, +Robots, -Worth) is det.

worth(P, S, Work, Robots, Makespan-Robot_time) :-
    low(P, S, Chain, Remaining),
    now(S, Now),
    running(S, Runs),
    busy(Runs, Now, Busy, Last),
    Shared is (Remaining + Busy + Robots - 1) // Robots,
    Makespan is Now + max(Last, max(Chain, Shared)),
    Robot_time is Work + Remaining.

busy([], _, 0, 0).
busy([run(End, Agent, _, _)|Runs], Now, Busy, Last) :-
    busy(Runs, Now, Busy0, Last0),
    Left is max(0, End - Now),
    Last is max(Last0, Left),
    (   Agent == none -> Busy = Busy0 ; Busy is Busy0 + Left ).

%!  low(+Program, +Situation, -Chain, -Work) is det.
%
%   Lower bounds of the longest chain and of the robot time that Program still takes.

low([], _, 0, 0).
low([P|Ps], S, C, W) :- low(P, S, C1, W1), low(Ps, S, C2, W2), C is C1 + C2, W is W1 + W2.
low(test(_), _, 0, 0).
low(choice(_, _, Ps), S, C, W) :- least(P, member(P, Ps), S, C, W).
low(pick(Frame, Step, V, Class, P), S, C, W) :-
    atomic_list_concat([Frame, /, Step], Id),
    least(Bound,
          ( member_of(Class, X, S), \+ excluded(Id, X, S), copy_term(V-P, X-Bound) ),
          S, C, W).
low(picked(_, _, P), S, C, W) :- low(P, S, C, W).
low(if(_, P, Q), S, C, W) :- least(R, member(R, [P, Q]), S, C, W).
low(while(_, _), _, 0, 0).
low(until(P, _), S, C, W) :- low(P, S, C, W).
low(conc(Ps), S, C, W) :- low_all(Ps, S, C, W).
low(foreach(F, Step, Vs, Cond, Inner, P), S, C, W) :-
    instances(F, Step, Vs, Cond, Inner-P, S, Turns),
    low_all(Turns, S, C, W).
low(call(_, _, Head), S, C, W) :- low_call(Head, S, C, W).
low(scope(_, _, P), S, C, W) :- low(P, S, C, W).
low(running(_), _, 0, 0).                           % counted with the runs

low_all([], _, 0, 0).
low_all([P|Ps], S, C, W) :-
    low(P, S, C1, W1),
    low_all(Ps, S, C2, W2),
    C is max(C1, C2),
    W is W1 + W2.

least(P, Goal, S, C, W) :-
    findall(C0-W0, ( Goal, low(P, S, C0, W0) ), Bounds),
    never(Never),
    foldl([C1-W1, A-B, M-N]>>( M is min(A, C1), N is min(B, W1) ), Bounds, Never-Never, C-W).

low_call(Head, S, C, W) :-
    revision(S, Revision),
    functor(Head, Name, _),
    agent_of(Head, Agent, S),
    (   Agent \== none, \+ capable(Revision, Name, Agent)
    ->  never(C), W = C
    ;   duration(Revision, Head, Duration)
    ->  shortest(Duration, S, C),
        (   Agent == none -> W = 0 ; W = C )
    ;   expansion(low, Head, S, Body),
        low(Body, S, C, W)
    ).

shortest(fixed(Milliseconds), _, Milliseconds).
shortest(travel(Robot, To, More), S, Milliseconds) :-
    findall(T, travel_time(Robot, _, To, T, S), Times),
    never(Never),
    foldl([T, A, B]>>( B is min(A, T) ), Times, Never, Least),
    Milliseconds is Least + More.

%!  calls(+Program, +Situation, -Heads) is det.
%
%   Every call that some execution may make, as far as it is known before acting: what travel times
%   are needed for, and what can be said of a program that nobody can do.

calls(P, S, Heads) :-
    findall(Head, call_of(P, S, Head), Heads0),
    sort(Heads0, Heads).

call_of([P|Ps], S, H) :- ( call_of(P, S, H) ; call_of(Ps, S, H) ).
call_of(choice(_, _, Ps), S, H) :- call_of(Ps, S, H).
call_of(pick(_, _, V, Class, P), S, H) :- member_of(Class, X, S), copy_term(V-P, X-Q), call_of(Q, S, H).
call_of(picked(_, Pick, P), S, H) :- ( call_of(P, S, H) ; call_of(Pick, S, H) ).
call_of(if(_, P, Q), S, H) :- ( call_of(P, S, H) ; call_of(Q, S, H) ).
call_of(while(_, P), S, H) :- call_of(P, S, H).
call_of(until(P, _), S, H) :- call_of(P, S, H).
call_of(conc(Ps), S, H) :- call_of(Ps, S, H).
call_of(foreach(F, Step, Vs, C, Inner, P), S, H) :-
    instances(F, Step, Vs, C, Inner-P, S, Turns),
    call_of(Turns, S, H).
call_of(scope(_, Head, P), S, H) :- ( H = Head ; call_of(P, S, H) ).
call_of(call(_, _, Head), S, H) :-
    (   H = Head
    ;   revision(S, Revision),
        \+ duration(Revision, Head, _),
        expansion(call, Head, S, Body),
        call_of(Body, S, H)
    ).

%!  lumped(+Program, +Situation, -Program, -Situation) is det.
%
%   For looking ahead from the middle of things: a composite process with a duration model that has
%   begun is one durative step that still takes as long as from where its robot is.

lumped([P|Ps], S, [P1|Ps], S1) :- !, lumped(P, S, P1, S1).
lumped(conc(Ps), S, conc(Qs), S1) :- !, foldl_lumped(Ps, S, Qs, S1).
lumped(picked(Id, Pick, P), S, picked(Id, Pick, Q), S1) :- !, lumped(P, S, Q, S1).
lumped(scope(Id, Head, P), S, Q, S1) :- !,
    (   planned_duration(Head, Duration, S)
    ->  agent_of(Head, Agent, S),
        stop_agent(Agent, S, S0),
        start(Id, Head, Agent, Duration, S0, S1),
        Q = running(Id)
    ;   lumped(P, S, P1, S1),
        Q = scope(Id, Head, P1)
    ).
lumped(P, S, P, S).

foldl_lumped([], S, [], S).
foldl_lumped([P|Ps], S, [Q|Qs], S1) :-
    lumped(P, S, Q, S0),
    foldl_lumped(Ps, S0, Qs, S1).

stop_agent(Agent, S0, S) :-
    running(S0, Runs),
    (   memberchk(run(_, Agent, Id, _), Runs) -> stop(Id, S0, S) ; S = S0 ).
