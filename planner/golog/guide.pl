:- module(planner_guide,
          [ no_guide/1,                 % -Guide
            guide/3,                    % +Events, +Situation, -Guide
            proposed_guide/3,           % +Choices, +Steps, -Guide
            guide_of/2,                 % +Situation, -Guide
            guided/1,                   % +Situation
            unguided/2,                 % +Situation, -Situation
            next_choice/3,              % +Id, -Choice, +Situation
            take_choice/4,              % +Id, +Choice, +Situation, -Situation
            in_order/5,                 % +Id, +Head, +Agents, +Situation, -Situation
            next_step/3,                % +Agent, -Id, +Situation
            open_steps/2,               % +Guide, -Ids
            without/3                   % +Begun, +Guide, -Guide
          ]).

/** <module> What a plan decides

    guide(Choices, Order)
      Choices   AVL tree: id of a choice -> [Choice, ...], in the order in which they are taken: a loop
                comes to the same choice several times
      Order     AVL tree: robot, or resource(R) -> ids of the steps that it does or that use it, in order

Executed along a guide, a program takes these choices, and each robot and resource serves its steps in
this order. Where a guide says nothing, because only acting finds out what is to be done, the first
choice that can be taken is taken, and steps begin as soon as they can.
*/

:- use_module(library(assoc)).
:- use_module(library(lists)).
:- use_module(library(apply)).
:- use_module(library(pairs)).
:- use_module(planner_golog(projection)).
:- use_module(planner_golog(actions)).

no_guide(guide(Empty, Empty)) :-
    empty_assoc(Empty).

%!  guide(+Events, +Situation, -Guide) is det.
%
%   What an execution decides; Events, oldest first, are what trans/4 noted.

guide(Events, S, guide(Choices, Order)) :-
    findall(Id-X, member(chose(Id, X), Events), Chosen),
    queues(Chosen, Choices),
    findall(Who-Id, served(Events, S, Who, Id), Steps),
    queues(Steps, Order).

served(Events, S, Who, Id) :-
    member(Event, Events),
    (   Event = started(Id, Head, Agents, _, _)
    ->  ( member(Who, Agents) ; claimed(Head, S, Who) )
    ;   Event = begun(Id, Head)
    ->  claimed(Head, S, Who)
    ).

claimed(Head, S, resource(R)) :-
    claims_of(Head, Resources, S),
    member(R, Resources).

queues(Pairs0, Queues) :-
    keysort(Pairs0, Pairs),                         % stable: what is of one key stays in order
    group_pairs_by_key(Pairs, Groups),
    list_to_assoc(Groups, Queues).

%!  proposed_guide(+Choices, +Steps, -Guide) is det.
%
%   Choices is a list of Id-Choice, Steps a list of Id-[Who, ...] in order of start.

proposed_guide(Chosen, Steps, guide(Choices, Order)) :-
    queues(Chosen, Choices),
    findall(Who-Id, ( member(Id-Everyone, Steps), member(Who, Everyone) ), Served),
    queues(Served, Order).

%!  guide_of(+Situation, -Guide) is semidet.

guide_of(S, Guide) :-
    mode(S, Mode),
    ( Mode = act(Guide) -> true ; Mode = replay(_, Guide) ).

guided(S) :-
    guide_of(S, _).

%!  unguided(+Situation, -Situation) is det.
%
%   The same situation, with every choice open.

unguided(S0, S) :-
    mode(S0, Mode0),
    (   Mode0 = replay(Travel, _) -> with_mode(S0, plan(Travel), S)
    ;   Mode0 = act(_) -> no_guide(Guide), with_mode(S0, act(Guide), S)
    ;   S = S0
    ).

with_guide(S0, Guide, S) :-
    mode(S0, Mode0),
    ( Mode0 = act(_) -> Mode = act(Guide) ; Mode0 = replay(Travel, _), Mode = replay(Travel, Guide) ),
    with_mode(S0, Mode, S).

%!  next_choice(+Id, -Choice, +Situation) is semidet.
%
%   What the guide, if there is one, says next about a choice.

next_choice(Id, Choice, S) :-
    guide_of(S, guide(Choices, _)),
    get_assoc(Id, Choices, [Choice|_]).

%!  take_choice(+Id, +Choice, +Situation, -Situation) is det.
%
%   The choice is taken and noted.

take_choice(Id, Choice, S0, S) :-
    (   guide_of(S0, guide(Choices, Order)), get_assoc(Id, Choices, [Choice|Later])
    ->  put_assoc(Id, Choices, Later, Choices1),
        with_guide(S0, guide(Choices1, Order), S1)
    ;   S1 = S0
    ),
    note(chose(Id, Choice), S1, S).

%!  in_order(+Id, +Head, +Agents, +Situation, -Situation) is semidet.
%
%   It is the turn of the step Id with all that do it and that it claims. What the plan took as one step
%   has steps of its own, of which the plan says nothing.

in_order(Id, Head, Agents, S0, S) :-
    (   guide_of(S0, guide(Choices, Order0)), \+ empty_assoc(Order0)
    ->  claims_of(Head, Resources, S0),
        findall(resource(R), member(R, Resources), Claimed),
        append(Agents, Claimed, Everyone),
        foldl(turn(Id), Everyone, Order0, Order),
        ( same_term(Order, Order0) -> S = S0 ; with_guide(S0, guide(Choices, Order), S) )
    ;   S = S0
    ).

turn(Id, Who, Order0, Order) :-
    (   get_assoc(Who, Order0, Steps), memberchk(Id, Steps)
    ->  Steps = [Id|Later],
        put_assoc(Who, Order0, Later, Order)
    ;   Order = Order0
    ).

%!  next_step(+Agent, -Id, +Situation) is semidet.
%
%   What the robot is to do next.

next_step(Agent, Id, S) :-
    guide_of(S, guide(_, Order)),
    get_assoc(Agent, Order, [Id|_]).

%!  open_steps(+Guide, -Ids) is det.
%
%   The steps that have not begun.

open_steps(guide(_, Order), Ids) :-
    assoc_to_values(Order, Lists),
    append(Lists, Ids0),
    sort(Ids0, Ids).

%!  without(+Begun, +Guide, -Guide) is det.
%
%   The guide without steps that have begun already.

without(Begun, guide(Choices, Order), guide(Choices, Order1)) :-
    map_assoc(left_of(Begun), Order, Order1).

left_of(Begun, Steps, Left) :-
    subtract(Steps, Begun, Left).
